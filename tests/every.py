"""A claim about many like cases as one test, which names all cases that break it."""

from __future__ import annotations

import inspect
import reprlib
from collections.abc import Callable, Iterable
from typing import Any

import pytest


def every(
    cases: Iterable[Any], name: Callable[[Any], str] = reprlib.repr
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make one test of a check on each case; a case that is a tuple is passed as several arguments.

    Arguments of the check behind those of a case are fixtures, which all cases share.

    Parameters
    ----------
    cases
        All cases; at least one.
    name
        Names a case where it fails.
    """
    each = [case if isinstance(case, tuple) else (case,) for case in cases]
    assert each, "a claim about no case at all cannot fail"

    def made(check: Callable[..., None]) -> Callable[..., None]:
        def test(**fixtures: Any) -> None:
            failed = []
            for case in each:
                try:
                    check(*case, **fixtures)
                except (Exception, pytest.fail.Exception) as error:  # every kind is a case that breaks the claim  # noqa: BLE001
                    failed.append(f"{name(case if len(case) > 1 else case[0])}: {type(error).__name__}: {error}")
            assert not failed, f"{len(failed)} of {len(each)}:\n" + "\n".join(failed)

        test.__name__, test.__module__, test.__qualname__ = check.__name__, check.__module__, check.__qualname__
        behind = list(inspect.signature(check).parameters.values())[len(each[0]) :]
        test.__signature__ = inspect.Signature(behind)  # type: ignore[attr-defined]
        return test

    return made
