"""Motions near set points, from curves in both directions: where the search for operating points starts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.core.arrays import Array
from dforce.core.quantities import MOTION, REPEATS
from dforce.experiments import Approach, Branches
from dforce.experiments.base import Progress
from dforce.findings.set_point import at_set_point
from dforce.maps._sweep import sweep
from dforce.runs import carry_out

if TYPE_CHECKING:
    import xarray as xr


FAR = 1.6  # free amplitudes: where curves start
# free amplitudes: where they end; lower where the amplitude on a soft sample does not fall before
NEAR = (0.3, -0.2, -1.2)
STEPS = 0.0125  # of the free amplitude: between two points of a curve
SEARCHED, LARGEST_STEP = 3, 0.05  # of branches: distances at which others are looked for, and their largest step
KEPT = ("amplitude_ratio", "virial", MOTION)


@dataclass(frozen=True)
class Seed:
    """A motion near a set point: number of the case and of the set point, distance (m), motion in SI, and its direction."""

    case: int
    set_point: int
    zc: float
    motion: Array
    direction: str


@dataclass
class Curves:
    """The curves of cases one by one: parts of some cases, each with their numbers."""

    parts: list[tuple[Any, xr.Dataset]]
    interrupted: bool = False
    walked: dict[int, xr.Dataset] = field(default_factory=dict)  # branches of cases, by their numbers

    def _of(self, case: int) -> Iterator[tuple[Array, Array]]:
        """Give the distances (m) and the motions (directions, distances, components) of a case, where it has curves."""
        for numbers, data in self.parts:
            for place in np.flatnonzero(numbers == case):
                motion = data[MOTION].isel(case=place).transpose("direction", ..., "component")
                yield _distances(numbers, data)[place], motion.values

    def nearest(self, case: int) -> float:
        """Return the distance (m) at which the curves of a case end."""
        zc, _ = next(self._of(case))
        return float(zc.min())

    def lowest_ratio(self) -> float:
        """Return the lowest amplitude ratio on all curves."""
        return min((float(data["amplitude_ratio"].min()) for _, data in self.parts), default=1.0)

    def seeds(self, set_points: Sequence[float] | Array) -> Iterator[Seed]:
        """Give a motion of each curve beside each of its states at the set points."""
        for numbers, data in self.parts:
            zc = _distances(numbers, data)
            motion = data[MOTION].transpose("case", "direction", ..., "component").values
            ratio = data["amplitude_ratio"].transpose("case", "direction", ...).values
            for j, set_point in enumerate(set_points):
                states = at_set_point(data, float(set_point), ["amplitude_ratio"])
                for place, crossing in zip(*np.nonzero(np.isfinite(states["zc"].values)), strict=True):
                    at, way = (states[name].values[place, crossing] for name in ("zc", "direction"))
                    d = data["direction"].values.tolist().index(way)
                    beside = np.argsort(np.abs(zc[place] - at), kind="stable")[:2]
                    nearest = min(beside, key=lambda i: abs(ratio[place, d, i] - set_point))  # used at once
                    yield Seed(int(numbers[place]), j, float(zc[place, nearest]), motion[place, d, nearest], str(way))
        for number, branches in self.walked.items():
            for j, set_point in enumerate(set_points):
                for i in _passes(branches, "amplitude_ratio", float(set_point)):
                    yield Seed(number, j, float(branches["zc"][i]), branches[MOTION].values[i], "branches")

    def beside(self, case: int, zc: float) -> Iterator[tuple[float, Array]]:
        """Give distances and motions of a case's curves that are next to a distance, in both directions."""
        for own, motion in self._of(case):
            for i in np.argsort(np.abs(own - zc), kind="stable")[:2]:
                for way in motion[:, i]:
                    if np.isfinite(way).all():
                        yield float(own[i]), way
        if case in self.walked:
            for i in _passes(self.walked[case], "zc", zc):
                yield float(self.walked[case]["zc"][i]), self.walked[case][MOTION].values[i]


def _distances(numbers: Any, data: xr.Dataset) -> Array:
    """Return the distances (m) of each of some cases."""
    return np.broadcast_to(data["zc"].values, (len(numbers), data["zc"].shape[-1]))


def _passes(branches: xr.Dataset, name: str, value: float) -> Iterator[int]:
    """Give the points next to where stable states of one common period pass a value."""
    past = branches[name].values - value
    usable = branches["stable"].values & (branches[REPEATS].values == branches[REPEATS].values.min())
    together = usable[1:] & usable[:-1] & (np.diff(branches["branch"].values) == 0)
    for i in np.flatnonzero((past[1:] * past[:-1] <= 0.0) & together).tolist():
        yield min((i, i + 1), key=lambda n: abs(past[n]))


def walk(curves: Curves, number: int, case: Case, check_cancelled: Callable[[], None]) -> None:
    """Follow the branches of one of the cases through folds, and look for others, over the distances of its curves.

    Raises
    ------
    KeyboardInterrupt
        When it is stopped.
    """
    span = {"start": FAR * case.problem.tones[0].A0, "stop": curves.nearest(number)}
    experiment = Branches(zc=span, search=SEARCHED, largest_step=LARGEST_STEP, harmonics=1)
    found = carry_out(case.model_copy(update={"experiment": experiment}), lambda *_: check_cancelled())
    if found.attrs.get("interrupted"):
        raise KeyboardInterrupt
    curves.walked[number] = found


def curves_of(case: Case, rows: dict[str, Any], lowest: float, progress: Progress | bool | None) -> Curves:
    """Return the curves of cases, each from far away to where its amplitude ratio is below `lowest`, in both directions."""
    left = np.arange(len(next(iter(rows.values()))))
    curves = Curves([])
    for stop in NEAR:
        points = 1 + round((FAR - stop) / STEPS)
        grid = {"of": "drive.A0", "start": FAR, "stop": stop, "points": points}
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
            curves.parts.append((left[done], data.isel(case=np.flatnonzero(done))))
        left = left[~done]
        if not len(left):
            break
    return curves
