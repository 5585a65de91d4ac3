"""Lines of operating points along a parameter, the boundaries on them, and the states that they show."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from dforce.case import Case
from dforce.core.arrays import Array
from dforce.maps.axes import Axis
from dforce.maps.loci import DEEPEST, LARGEST, MOST_POINTS, FreeParameter, LineOrbit, Lines
from dforce.maps.seeds import Curves
from dforce.procedures.motion import scaled
from dforce.solvers.continuation import Curve, located
from dforce.solvers.orbit import FOLD, GRAZING

# the meanings of a cell of the map, by its number in the result
REGIMES = ("none", "no contact", "attractive", "both", "repulsive")
END, UNSTABLE, LOST = "end", "instability", "lost"
NET_FORCE, CONTACT = "net force", "contact"
AT_VALUE = 1e-9  # scaled: a point so near to a value of the parameter is at it
AT_END = 1e-5  # scaled: a line that ends so near to an end of the range has left it
SAME = 0.01  # of the free amplitude: a motion so near to a line lies on it


@dataclass
class StateLine:
    """The operating points of a row of the map along the parameter, in order, and the boundaries on it.

    The row is a set point, or a value (SI) of the second parameter.
    """

    row: float
    length: float
    places: list[LineOrbit]
    edges: list[tuple[str, LineOrbit]]


@dataclass(frozen=True)
class Row:
    """A row of the map: the case with the second parameter at its value, the set point, and how the row is called."""

    case: Case
    share: float
    row: float


def lines_at(
    of: Row, axis: Axis, free_parameter: FreeParameter, curves: Curves, check_cancelled: Callable[[], None]
) -> list[StateLine]:
    """Return the lines of operating points of a row."""
    case, values = of.case, [float(value) for value in axis.values]
    lines = Lines(case, free_parameter, of.share, values)
    out: list[StateLine] = []
    for seed in curves.seeds([of.share]):
        value, problem = values[seed.case], lines.problem_with(values[seed.case])
        state = scaled(seed.motion[None], problem)
        if any(_lies_on(line.places, state.x[0], seed.zc / lines.length, free_parameter.scaled(value)) for line in out):
            continue
        start = lines.seed(state, seed.zc, value)
        if start is None:
            continue
        line = Curve(start)
        line.grow(lines, LARGEST, MOST_POINTS, check_cancelled)
        places = cast(list[LineOrbit], line.points)
        out.append(StateLine(of.row, lines.length, places, _edges(lines, places, case.problem.a0)))
    return out


def _lies_on(places: list[LineOrbit], x: Array, zc: float, scaled: float) -> bool:
    """Return whether a scaled motion at a scaled distance lies on a line, where the line passes the parameter's value."""
    for a, b, share in _passing(places, scaled):
        u = a.u + share * (b.u - a.u)
        # the motion is beside the set point: both motion and distance differ from the line's by as much
        moved = abs(zc - u[0])
        if np.abs(x - u[1 : 1 + len(x)]).max() < SAME + 2.0 * moved and moved < 5.0 * SAME:
            return True
    return False


def _past(place: LineOrbit, scaled: float) -> float:
    """Return how far a point is past a scaled value of the parameter; 0 where that is rounding, as at the ends of ranges."""
    past = float(place.u[-1]) - scaled
    return past if abs(past) > AT_VALUE else 0.0


def _passing(places: list[LineOrbit], scaled: float) -> Iterator[tuple[LineOrbit, LineOrbit, float]]:
    """Give where a line passes a scaled value of the parameter: two neighbors, and the share of the way between them."""
    for a, b in itertools.pairwise(places if len(places) > 1 else 2 * places):
        low, high = _past(a, scaled), _past(b, scaled)
        if low == 0.0 or low * high < 0.0:
            yield a, b, low / (low - high) if low else 0.0
        elif high == 0.0 and b is places[-1]:
            yield a, b, 1.0


def _edges(lines: Lines, places: list[LineOrbit], a0: float) -> list[tuple[str, LineOrbit]]:
    """Return the boundaries between stable stretches of a line and others, located."""
    tests: dict[str, Callable[[LineOrbit], float]] = {
        FOLD: lambda place: place.determinant,
        NET_FORCE: lambda place: place.measured["virial"],
        CONTACT: lambda place: place.measured["min_distance"] - a0,
    }
    found = [(END, place) for place in places if place.special == FOLD and place.is_stable]
    for last in {id(place): place for place in (places[0], places[-1])}.values():
        left = min(last.u[-1], 1.0 - last.u[-1], last.u[0] - DEEPEST) < AT_END
        if last.is_stable and not left:  # where the map is too rough no step leads on: that is said, not passed over
            found.append((GRAZING if lines.switches_beside(last) else LOST, last))
    # a place on an edge is neither stable nor unstable: the edge lies between the two beside it
    for a, b in itertools.pairwise([place for place in places if place.stability]):
        if not (a.is_stable or b.is_stable):
            continue
        kinds = [kind for kind, test in tests.items() if test(a) * test(b) < 0.0]
        found += [(kind, located(lines, a, b, tests[kind])) for kind in kinds]
        if a.is_stable != b.is_stable and FOLD not in kinds:
            found.append((UNSTABLE, a if a.is_stable else b))
    return found


def _kind(place: LineOrbit, a0: float) -> str:
    if place.measured["virial"] < 0.0:
        return "repulsive"
    return "no contact" if place.measured["min_distance"] > a0 else "attractive"


def cells(
    lines: Sequence[StateLine], axis_values: Array, rows: Array, free_parameter: FreeParameter, a0: float
) -> tuple[Any, Any]:
    """Return the regime (its number) and how many stable states there are, (values, rows)."""
    regime = np.zeros((len(axis_values), len(rows)), dtype=np.int8)
    count = np.zeros_like(regime)
    for j, row in enumerate(rows):
        of_row = [line for line in lines if line.row == row]
        for i, value in enumerate(axis_values):
            kinds: list[str] = []
            for line in of_row:
                kinds += _stable_at(line.places, free_parameter.scaled(value), a0)
            count[i, j] = len(kinds)
            regime[i, j] = REGIMES.index(_together(set(kinds)))
    return regime, count


def _stable_at(places: list[LineOrbit], scaled: float, a0: float) -> list[str]:
    """Return the regimes of the stable states of a line at a value of the parameter; of two neighbors the nearer decides."""
    near = (a if share <= 0.5 else b for a, b, share in _passing(places, scaled))
    return [_kind(place, a0) for place in near if place.is_stable]


def _together(kinds: set[str]) -> str:
    if not kinds:
        return "none"
    if "repulsive" in kinds:
        return "repulsive" if kinds == {"repulsive"} else "both"
    return "attractive" if "attractive" in kinds else "no contact"
