"""Motions near set points, from curves in both directions: where the search for operating points starts."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.core.arrays import Array, Bools, Indices
from dforce.core.quantities import MOTION
from dforce.experiments import Approach
from dforce.experiments.base import Progress
from dforce.findings.set_point import at_set_point
from dforce.maps._sweep import sweep
from dforce.observables.averaging import weights
from dforce.observables.finish import first_ratios
from dforce.procedures.motion import base_of, rows_of, scales_of
from dforce.results.status import repeats
from dforce.solvers.continuation import Curve
from dforce.solvers.parameter_range import ParameterRange
from dforce.solvers.search import Known, candidates, search

if TYPE_CHECKING:
    import xarray as xr


FAR = 1.6  # free amplitudes of the tip: where curves start
# free amplitudes of the tip: where they end; lower where the amplitude on a soft sample does not fall before
NEAR = (0.3, -0.2, -1.2)
STEPS = 0.0125  # of the free amplitude: between two points of a curve
SEARCHED, LARGEST_STEP = 7, 0.05  # of branches: distances at which others are looked for, and their largest step
MOST_POINTS = 10_000  # of the branches of a case
KEPT = ("amplitude_ratio", "virial", MOTION)


@dataclass(frozen=True)
class Seed:
    """A motion near a set point: number of the case and of the set point, distance (m), motion in SI, and its direction.

    A branch passes the set point `between` two distances (m), with states that are no saddles; else it is None.
    """

    case: int
    set_point: int
    zc: float
    motion: Array
    direction: str
    between: tuple[float, float] | None = None


@dataclass(frozen=True)
class Branch:
    """The states of one branch in order, all after one common period.

    Attributes
    ----------
    zc, amplitude_ratio, motions
        Distances (m), amplitude ratios and motions in SI.
    stable, saddle
        Whether each state is stable, or a saddle. All other states alternate or beat.
    """

    zc: Array
    amplitude_ratio: Array
    motions: Array
    stable: Bools
    saddle: Bools

    def at_ratio(self, set_point: float) -> Iterator[tuple[int, int]]:
        """Give the pairs of neighbors, not both saddles, between which the amplitude ratio passes a set point."""
        yield from _pairs(self.amplitude_ratio - set_point, ~(self.saddle[1:] & self.saddle[:-1]))

    def goes_on(self, near: float, lowest: float) -> bool:
        """Return whether the branch, without saddles, reaches the nearest distance at an amplitude ratio above the lowest."""
        ends = [0, -1]
        is_there = np.isclose(self.zc[ends], near, rtol=1e-9, atol=0.0)
        return bool((is_there & ~self.saddle[ends] & (self.amplitude_ratio[ends] > lowest)).any())

    def at_distance(self, zc: float) -> Iterator[int]:
        """Give the points next to where stable states pass a distance (m)."""
        for pair in _pairs(self.zc - zc, self.stable[1:] & self.stable[:-1]):
            yield min(pair, key=lambda n: abs(self.zc[n] - zc))


@dataclass(frozen=True)
class Part:
    """The curves of some cases: the numbers of these cases, and their sweep."""

    numbers: Indices
    data: xr.Dataset

    def of(self, number: int) -> Part:
        """Return the curves of one of the cases."""
        which = np.flatnonzero(self.numbers == number)
        return Part(self.numbers[which], self.data.isel(case=which))

    @functools.cached_property
    def zc(self) -> Array:
        """Distances (m) of each case, (cases, distances)."""
        zc = self.data["zc"].values
        return np.broadcast_to(zc, (len(self.numbers), zc.shape[-1]))

    @functools.cached_property
    def motions(self) -> Array:
        """Motions in SI, (cases, directions, distances, components)."""
        return self.data[MOTION].transpose("case", "direction", ..., "component").values


@dataclass
class Curves:
    """The curves of cases one by one."""

    parts: list[Part]
    interrupted: bool = False
    walked: dict[int, list[Branch]] = field(default_factory=dict)  # of cases, by their numbers

    def _of(self, case: int) -> Iterator[tuple[Array, Array]]:
        """Give the distances (m) and the motions (directions, distances, components) of a case, where it has curves."""
        for part in self.parts:
            for place in np.flatnonzero(part.numbers == case):
                yield part.zc[place], part.motions[place]

    def nearest(self, case: int) -> float:
        """Return the distance (m) at which the curves of a case end."""
        zc, _ = next(self._of(case))
        return float(zc.min())

    def lowest_ratio(self) -> float:
        """Return the lowest amplitude ratio on all curves."""
        return min((float(part.data["amplitude_ratio"].min()) for part in self.parts), default=1.0)

    def seeds(self, set_points: Sequence[float] | Array, only: int | None = None) -> Iterator[Seed]:
        """Give a motion of each curve beside each of its states at the set points; of one case alone on demand."""
        for part in self.parts if only is None else [part.of(only) for part in self.parts if only in part.numbers]:
            zc, motions, data = part.zc, part.motions, part.data
            ratio = data["amplitude_ratio"].transpose("case", "direction", ...).values
            steady = repeats(data["status"].transpose("case", "direction", ...).values)
            for j, set_point in enumerate(set_points):
                states = at_set_point(data, float(set_point), ["amplitude_ratio"])
                for place, crossing in zip(*np.nonzero(np.isfinite(states["zc"].values)), strict=True):
                    at, way = (states[name].values[place, crossing] for name in ("zc", "direction"))
                    d = data["direction"].values.tolist().index(way)
                    beside = np.argsort(np.abs(zc[place] - at), kind="stable")[:2]
                    nearest = min(beside, key=lambda i: abs(ratio[place, d, i] - set_point))  # used at once
                    yield Seed(
                        int(part.numbers[place]), j, float(zc[place, nearest]), motions[place, d, nearest], str(way)
                    )
                # a state may pass the set point just before it loses its stability, where the next point repeats no more
                for place, d, i in np.argwhere(_last_before(ratio, steady, float(set_point))):
                    way = data["direction"].values[d]
                    yield Seed(int(part.numbers[place]), j, float(zc[place, i]), motions[place, d, i], str(way))
        for number, branches in self.walked.items() if only is None else [(only, self.walked[only])]:
            for branch, (j, set_point) in itertools.product(branches, enumerate(set_points)):
                for pair in branch.at_ratio(float(set_point)):
                    ends = None if branch.saddle[list(pair)].any() else _ordered(branch.zc[list(pair)])
                    for i in pair:
                        yield Seed(number, j, float(branch.zc[i]), branch.motions[i], "branches", ends)

    def beside(self, case: int, zc: float) -> Iterator[tuple[float, Array]]:
        """Give distances and motions of a case's curves that are next to a distance, in both directions."""
        for own, motion in self._of(case):
            for i in np.argsort(np.abs(own - zc), kind="stable")[:2]:
                for way in motion[:, i]:
                    if np.isfinite(way).all():
                        yield float(own[i]), way
        for branch in self.walked.get(case, []):
            for i in branch.at_distance(zc):
                yield float(branch.zc[i]), branch.motions[i]


def _last_before(ratio: Array, steady: Bools, set_point: float) -> Bools:
    """Return which motions repeat, while a neighbor beyond the set point does not, (cases, directions, distances)."""
    above = ratio > set_point
    alone = np.zeros(steady.shape, dtype=bool)
    passed = above[..., 1:] != above[..., :-1]
    alone[..., :-1] |= passed & steady[..., :-1] & ~steady[..., 1:]
    alone[..., 1:] |= passed & steady[..., 1:] & ~steady[..., :-1]
    return alone


def _pairs(past: Array, among: Bools) -> Iterator[tuple[int, int]]:
    """Give two neighbors each between which a value passes zero, where the pair is among some."""
    for i in np.flatnonzero((past[1:] * past[:-1] <= 0.0) & among).tolist():
        yield i, i + 1


def _ordered(ends: Array) -> tuple[float, float]:
    return float(ends.min()), float(ends.max())


def walk(curves: Curves, number: int, case: Case, lowest: float, check_cancelled: Callable[[], None]) -> None:
    """Follow the branches of one of the cases through folds, and look for others, over the distances of its curves.

    The walk goes on to nearer distances while another motion than the curves' has more than the `lowest` amplitude ratio.
    Motions of one common period alone are followed, and none is measured as accurately as asked: seeds need neither.
    """
    A0, nearest = case.problem.tones[0].A0 * case.problem.tip_share, curves.nearest(number)
    searched = np.linspace(FAR * A0, nearest, SEARCHED).tolist()
    for near in (nearest, *(share * A0 for share in NEAR if share * A0 < nearest - STEPS * A0)):
        searched += [0.5 * (searched[-1] + near), near] if near < nearest else []
        branches = _followed(case, searched, check_cancelled)
        if not any(branch.goes_on(near, lowest) for branch in branches):
            break
    curves.walked[number] = branches


def _followed(case: Case, searched: list[float], check_cancelled: Callable[[], None]) -> list[Branch]:
    """Return the branches between the first and the last of some distances (m), at all of which states are looked for."""
    problem, far, near = case.problem, searched[0], searched[-1]
    among = ParameterRange(lambda _: problem, far, near, case.solver, 1)
    found: list[Curve] = []

    def grow(curve: Curve) -> None:
        left = MOST_POINTS - sum(len(one.points) for one in found)
        if left > 1:
            found.append(curve)
            curve.grow(among, LARGEST_STEP, left, check_cancelled)

    free = among.free_orbit(far / among.span)
    if free is not None:
        grow(Curve.rising(free, near - far))
    # few starts at many distances find more stable states, and sooner, than a search at a few until none is missing
    few = functools.partial(candidates, rounds=1)
    for value in np.array(searched) / among.span:
        for curve in search(Known(among, found, value), check_cancelled, few):
            if curve.repeats == 1:
                grow(curve)
    return [_branch(among, curve) for curve in found]


def _branch(among: ParameterRange, curve: Curve) -> Branch:
    """Return the states of a curve."""
    problem, orbits = among.problem, curve.points
    block, base = among.block(orbits[0].value), base_of(problem) * scales_of(problem)
    values, rows = (np.array([getattr(orbit, name) for orbit in orbits]) for name in ("value", "rows"))
    _, tones = block.tables_of(np.zeros(len(values), np.int64), values)
    return Branch(
        values,
        first_ratios(problem, rows, weights(block.frequencies, rows.shape[1]), tones),
        np.concatenate([rows_of(orbit.kept, np.ones(1), base, problem) for orbit in orbits]),
        np.array([orbit.is_stable for orbit in orbits]),
        np.array([orbit.index < 0 for orbit in orbits]),
    )


def curves_of(case: Case, rows: dict[str, Any], lowest: float, progress: Progress | bool | None) -> Curves:
    """Return the curves of cases, each from far away to where its amplitude ratio is below `lowest`, in both directions."""
    left = np.arange(len(next(iter(rows.values()))))
    curves, share = Curves([]), case.problem.tip_share
    for stop in NEAR:
        points = 1 + round((FAR - stop) / STEPS)
        grid = {"of": "drive.A0", "start": share * FAR, "stop": share * stop, "points": points}
        # operating points are measured as accurately as asked, their starts are not
        rough = case.solver.model_copy(update={"accuracy": None})
        asked = case.replace(experiment=Approach(zc=grid, direction="both", harmonics=1), sweep=None, solver=rough)
        some = {path: np.asarray(values)[left] for path, values in rows.items()}
        data = sweep(asked, rows=some, quantities=KEPT, progress=progress)
        if data.attrs.get("interrupted"):
            curves.interrupted = True
            return curves
        along = "zc_ratio" if "zc_ratio" in data.dims else "zc"
        deepest = data["amplitude_ratio"].isel({along: -1, "direction": 0}).values
        done = (deepest < lowest) if stop != NEAR[-1] else np.ones(len(left), dtype=bool)
        if done.any():
            curves.parts.append(Part(left[done], data.isel(case=np.flatnonzero(done))))
        left = left[~done]
        if not len(left):
            break
    return curves
