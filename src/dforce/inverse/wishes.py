"""Wishes of a plan: limits such as ``"< 100 pN"``, margins, and a goal; read with the units module, never evaluated."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce.case import Case
from dforce.case.paths import place_of, value_at
from dforce.core import units
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, nearest, shorten
from dforce.core.quantities import OBSERVABLES
from dforce.inverse.values import number_of

LIMIT = re.compile(r"\s*(<=?|>=?)\s*(.+?)\s*", re.DOTALL)
SHARE = re.compile(r"(.+?)\s+of\s+([\w.]+)", re.DOTALL)
WORDS = {"regime": ("attractive", "repulsive"), "states": ("one",)}
MARGIN = "margin"
SLOPE = "slope_of_phase"
NO_LIMIT = ("multiplier_modulus", "multiplier_angle", "harmonic_amplitude", "harmonic_phase", "error_estimate", "drift")
# the unit of distance from the boundaries along parameters without a margin
USUAL_MARGINS = {"set_point": 0.03, "": 0.05}


def limited() -> list[str]:
    """Return the names of the quantities that a plan may limit: the first value along tones or modes."""
    inner = {"tone", "mode"}
    return [name for name, one in OBSERVABLES.items() if set(one.dims) <= inner and name not in NO_LIMIT]


@dataclass(frozen=True)
class Limit:
    """A bound of a quantity: below (sign 1) or above (sign -1) a value (SI), or a share of the value at a path."""

    name: str
    text: str
    sign: float
    value: float
    path: str = ""

    def bounds(self, cases: Sequence[Case]) -> Array:
        """Return the bound (SI) in each case."""
        shares = [float(value_at(case, self.path)) if self.path else 1.0 for case in cases]
        return self.value * np.array(shares)


@dataclass(frozen=True)
class Margin:
    """How far around a point the limits hold as well: by so much of the value itself, or by so much (SI)."""

    size: float
    is_relative: bool

    def scaled(self, values: Any) -> Any:
        """Return values on a scale on which a margin is 1."""
        return np.log(np.abs(values)) / self.size if self.is_relative else np.asarray(values) / self.size

    def moved(self, values: Any, by: Any) -> Any:
        """Return values moved by so many margins."""
        return values * np.exp(np.asarray(by) * self.size) if self.is_relative else values + np.asarray(by) * self.size


@dataclass(frozen=True)
class Goal:
    """A quantity that is wanted small (sign 1) or large (sign -1); of a slope the path by whose logarithm it is taken."""

    name: str
    sign: float
    path: str = ""

    @property
    def key(self) -> str:
        """The name of its values in the result."""
        return SLOPE if self.path else self.name


@dataclass(frozen=True)
class Wishes:
    """All that a plan asks for."""

    limits: tuple[Limit, ...]
    regime: str
    one_state: bool
    margins: Mapping[str, Margin]
    asked_margins: frozenset[str]
    goals: tuple[Goal, ...]


def read_wishes(case: Case, paths: Sequence[str], limits: Any, goal: Any) -> Wishes:
    """Return the wishes from tables of limits and of a goal.

    Raises
    ------
    ParameterError
        With one sentence, for an entry that cannot be read.
    """
    limits = _table("limits", limits)
    known = [*limited(), *WORDS, MARGIN]
    found: list[Limit] = []
    for name, given in limits.items():
        if name not in known:
            raise ParameterError(f"plan.limits has no '{shorten(name)}'{nearest(str(name)[:100], known)}")
        if name in WORDS and not (isinstance(given, str) and given in WORDS[name]):
            raise ParameterError(f"plan.limits.{name} = {shorten(given)} is not {' or '.join(WORDS[name])}")
        if name not in (*WORDS, MARGIN):
            found.append(_limit(case, name, given))
    margins = _margins(case, paths, limits.get(MARGIN))
    return Wishes(
        tuple(found), str(limits.get("regime", "")), "states" in limits, margins[0], margins[1], _goals(case, goal)
    )


def _table(name: str, given: object) -> Mapping[str, Any]:
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise ParameterError(f"plan.{name} = {shorten(given)} is not a table")
    return given


def _limit(case: Case, name: str, given: Any) -> Limit:
    where, unit = f"plan.limits.{name}", OBSERVABLES[name].unit
    match = LIMIT.fullmatch(given) if isinstance(given, str) and len(given) <= 200 else None
    if match is None:
        raise ParameterError(f'{where} = {shorten(given)} is not a limit; write for example "< {_example(unit)}"')
    sign, rest = (1.0 if match[1].startswith("<") else -1.0), match[2]
    share = SHARE.fullmatch(rest)
    if share is not None:
        return _share(case, Limit(name, given, sign, number_of(where, share[1], "1"), share[2]), where)
    split = units.split_unit(rest)
    if unit != "1" and split is not None and not split[1]:
        raise ParameterError(
            f'{where} = {shorten(given)} has no unit; write for example "{match[1]} {split[0]} {_usual(unit)}"'
        )
    return Limit(name, given, sign, number_of(where, rest, unit))


def _share(case: Case, limit: Limit, where: str) -> Limit:
    own, unit = case.quantity(limit.path).unit, OBSERVABLES[limit.name].unit
    if own != unit:
        raise ParameterError(f"{where} is a share of {limit.path}, but this is in {own}, not in {unit}")
    if value_at(case, limit.path) is None:
        raise ParameterError(f"{where} is a share of {limit.path}, but the case has no such value")
    return limit


def _usual(unit: str) -> str:
    return {"N": "pN", "degree": "deg"}.get(unit, units.usual_unit(unit))


def _example(unit: str) -> str:
    return f"100 {_usual(unit)}" if unit != "1" else "0.5"


def _margins(case: Case, paths: Sequence[str], given: object) -> tuple[dict[str, Margin], frozenset[str]]:
    """Return the margin of each path and of the set point, and the requested margins."""
    out = {path: Margin(USUAL_MARGINS[""], True) for path in paths}
    out["set_point"] = Margin(USUAL_MARGINS["set_point"], False)
    asked: set[str] = set()
    places = {place_of(case, path): path for path in paths}
    for name, value in _table("limits.margin", given).items():
        where = f"plan.limits.margin.{name}"
        path = name if name in out else places.get(place_of(case, name))
        if path is None:
            raise ParameterError(f"{where} is a margin for a parameter that does not vary{nearest(name, out)}")
        relative = isinstance(value, str) and value.strip().endswith("%")
        unit = "1" if relative or path == "set_point" else case.quantity(path).unit
        size = number_of(where, value, unit)
        share = relative or path == "set_point"
        if not 0.0 < size < (1.0 if share else math.inf):
            raise ParameterError(f"{where} = {shorten(value)} is not above 0{' and below 1' if share else ''}")
        if relative and path == "set_point":
            raise ParameterError(f"{where} = {shorten(value)}; write it as a difference of set points, such as 0.03")
        out[path] = Margin(math.log1p(size) if relative else size, relative)
        asked.add(path)
    return out, frozenset(asked)


def _goals(case: Case, given: object) -> tuple[Goal, ...]:
    out: list[Goal] = []
    for word, wanted in _table("goal", given).items():
        if word not in ("minimize", "maximize"):
            raise ParameterError(
                f"plan.goal has no '{shorten(word)}'{nearest(str(word)[:100], ['minimize', 'maximize'])}"
            )
        names = [wanted] if isinstance(wanted, str) else wanted
        if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
            raise ParameterError(
                f"plan.goal.{word} = {shorten(wanted)} is not the name of a quantity, or a list of names"
            )
        for name in names:
            out.append(_goal(case, f"plan.goal.{word}", str(name), 1.0 if word == "minimize" else -1.0))
    if sum(bool(goal.path) for goal in out) > 1:
        raise ParameterError(f"plan.goal has more than one {SLOPE}; write one")
    return tuple(out)


def _goal(case: Case, where: str, text: str, sign: float) -> Goal:
    name, colon, path = text.partition(":")
    known = [*limited(), SLOPE]
    if name not in known:
        raise ParameterError(f"{where} = '{shorten(text)}' is not a quantity of a plan{nearest(name[:100], known)}")
    if name == SLOPE and not colon:
        raise ParameterError(f'{where} = {SLOPE} needs a parameter; write "{SLOPE}:sample.youngs_modulus", say')
    if name != SLOPE and colon:
        raise ParameterError(f"{where} = '{shorten(text)}' has a path, but only {SLOPE} takes a path")
    if colon:
        value = value_at(case, path)
        case.quantity(path)
        if not isinstance(value, float) or not value > 0.0:
            raise ParameterError(f"{where} is a slope by {path}, but this is not a number above 0 in the case")
    return Goal(name, sign, path)
