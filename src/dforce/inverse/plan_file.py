"""Plan files: a case, and a table `[plan]` with its limits and goals."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dforce import library
from dforce.case import Case
from dforce.core.errors import CaseError, ParameterError, checked, nearest, shorten
from dforce.core.files import beside, exists, read_input, text_of
from dforce.core.toml import LONGEST, read_toml

KEYS = ("vary", "set_points", "limits", "goal")


@dataclass(frozen=True)
class PlanFile:
    """The content of a plan file: the arguments of :func:`dforce.plan`.

    Attributes
    ----------
    case, vary, set_points, limits, goal
        As in :func:`dforce.plan`.
    """

    case: Case
    vary: Mapping[str, Any]
    set_points: Any
    limits: Mapping[str, Any] | None
    goal: Mapping[str, Any] | None


@checked
def load_plan(path: str | os.PathLike[str]) -> PlanFile:
    """Return the plan in a file: a case file with a table ``[plan]``; without such a file, in the shipped example of this name.

    Raises
    ------
    CaseError
        When the file cannot be read, is not a case, or has no table ``[plan]`` with `vary`.
    ForceError
        When a plug-in of the case fails.
    """
    file, name = Path(path), f"'{shorten(str(path), 200)}'"
    if str(path) in library.examples() and not exists(file):
        content = library.example_text(str(path)).encode()
    else:
        content = read_input(path, "plan", LONGEST, CaseError)
    text = text_of(content, name, CaseError)
    try:
        tables = read_toml(text)
    except ValueError as error:  # TOMLDecodeError is one
        raise CaseError(f"{name} cannot be read: {shorten(str(error), 200)}") from None
    asked = tables.pop("plan", None)
    try:
        _check(asked)
        with beside(file.resolve().parent):
            case = Case(**tables)
    except (CaseError, ParameterError) as error:
        raise CaseError(f"{shorten(file.name, 100)}: {error}") from None
    return PlanFile(case, asked["vary"], asked.get("set_points"), asked.get("limits"), asked.get("goal"))


def _check(asked: object) -> None:
    if not isinstance(asked, Mapping):
        raise ParameterError(
            'the table [plan] is missing; write the parameters to vary, such as vary = { "drive.A0" = ["1 nm", "9 nm"] }'
        )
    for key in asked:
        if key not in KEYS:
            raise ParameterError(f"plan has no '{shorten(key)}'{nearest(key[:100], KEYS)}")
    if not isinstance(asked.get("vary"), Mapping) or not asked["vary"]:
        raise ParameterError(
            'plan.vary is missing; write the parameters to vary, such as { "drive.A0" = ["1 nm", "9 nm"] }'
        )
