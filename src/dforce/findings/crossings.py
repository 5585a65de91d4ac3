"""Where curves meet the value of a quantity, such as a set point: between which points, and the states solved there."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import cases_of, has_parameters
from dforce.core.arrays import AnyArray, Bools
from dforce.core.errors import ParameterError
from dforce.core.quantities import ENDS, MOTION, MOTIONS, REPEATS
from dforce.findings.jumps import jumps_of_all
from dforce.results.curves import by_case
from dforce.results.status import repeats

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case

RATIO, SHIFT = "amplitude_ratio", "frequency_shift"
GUESSES = ("zc", "drive_frequency", "drive_ratio", MOTION, REPEATS)  # of a solved state, as far as a result has them
MOST_RECENT = 32  # curves and set points whose states are remembered
_RECENT: dict[Any, tuple[dict[str, AnyArray], Bools]] = {}
STRAY = 1e-3  # of the amplitude: how far a solved state may lie beyond the points next to it
# largest value of an angle (degrees) that is no phase lag; a phase lag reaches 270
HIGHEST = {"multiplier_angle": 180.0}


@dataclass(frozen=True)
class Crossings:
    """The points where curves meet the value of a quantity, such as a set point.

    Attributes
    ----------
    row, over, shape
        The dimension of the curves' points; the dimensions of a sweep's parameters, and their sizes.
    case, way
        Number of the case, and of the direction, of each state.
    before, after, share
        The points before and after it, and its place between them, from 0 to 1.
    """

    row: str
    over: Sequence[str]
    shape: tuple[int, ...]
    case: AnyArray
    way: AnyArray
    before: AnyArray
    after: AnyArray
    share: AnyArray

    @classmethod
    def of(cls, result: xr.Dataset, along: str, row: str, over: Sequence[str], met: str, value: float) -> Crossings:
        """Find the states at which the quantity `met` has a value."""
        of_branches = "branch" in result
        above, status = (by_case(result, name, row, over) for name in (met, "status"))
        above = above[..., 0] if above.ndim > status.ndim else above  # of several tones the first
        above = np.where(repeats(status), above - value, np.nan)
        x = result.variables[along].values
        order = np.arange(len(x)) if of_branches else np.argsort(x, kind="stable")
        sorted_ = above[..., order]
        apart = np.zeros(
            (*above.shape[:2], len(x)), dtype=bool
        )  # whether a point and the next are no neighbors; the last
        apart[..., -1] = True
        if of_branches:
            apart[..., :-1] = np.diff(result["branch"].values) != 0
        else:
            place = np.argsort(order)
            for number, direction, jumps in jumps_of_all(result, along):
                for jump in jumps:
                    low, high = sorted((place[jump.before], place[jump.after]))
                    apart[number, direction, low:high] = True
        beyond = np.append(sorted_[..., 1:], np.full((*above.shape[:2], 1), np.nan), axis=-1)
        crossed = (sorted_ == 0.0) | ((sorted_ * beyond < 0.0) & ~apart)
        case, way, first = np.nonzero(crossed)
        here, there = sorted_[crossed], beyond[crossed]
        between = here != 0.0
        share = np.divide(here, here - there, out=np.zeros(len(here)), where=between)
        shape = tuple(result.sizes[name] for name in over)
        return cls(row, over, shape, case, way, order[first], order[first + between], share)

    def table(self, values: AnyArray, fill: object) -> tuple[tuple[str, ...], AnyArray]:
        """Return values of the states over the parameters and `crossing`, with their dimensions."""
        counts = np.bincount(self.case, minlength=int(np.prod(self.shape)))
        number = np.arange(len(self.case)) - np.repeat(np.cumsum(counts) - counts, counts)
        out = np.full((len(counts), int(counts.max(initial=0)), *values.shape[1:]), fill, dtype=values.dtype)
        out[self.case, number] = values
        return (*self.over, "crossing"), out.reshape(*self.shape, *out.shape[1:])

    def solved(self, result: xr.Dataset, along: str, met: str, value: float) -> tuple[dict[str, AnyArray], Bools]:
        """Return quantities of the states as they are solved with the parameter unknown, and which of them are."""
        nothing: tuple[dict[str, AnyArray], Bools] = {}, np.zeros(len(self.case), dtype=bool)
        known = {name for name in GUESSES if name in result and self.row in result[name].dims}
        if not len(self.case) or met not in (RATIO, SHIFT) or MOTION not in known or not has_parameters(result):
            return nothing
        near = {name: self.read(result, name) for name in sorted(known)}
        if "branch" in result and not self.over:
            for name, of in ((ENDS, along), (MOTIONS, MOTION)):
                near[name] = np.stack(self._beside(result, of), axis=1)
        if self.over:
            return self._solve(result, met, value, near)
        # of one curve the same states are asked for again and again: by summary, table and picture
        place = [str(result.variables[name].values) for name in result.coords if not result.variables[name].dims]
        arrays = [one.tobytes() for one in (*near.values(), self.before, self.after)]
        key = result.attrs.get("case"), met, value, *place, *arrays
        found = _RECENT.get(key)
        if found is None:
            found = self._solve(result, met, value, near)
            while len(_RECENT) >= MOST_RECENT:
                _RECENT.pop(next(iter(_RECENT)), None)
            _RECENT[key] = found
        return found

    def _solve(
        self, result: xr.Dataset, met: str, value: float, near: Mapping[str, AnyArray]
    ) -> tuple[dict[str, AnyArray], Bools]:
        """Return quantities of the states that are found near guesses, and which of them are."""
        columns: dict[str, AnyArray] = {}
        solved = np.zeros(len(self.case), dtype=bool)
        numbers, which = np.unique(self.case, return_inverse=True)
        places = [dict(zip(self.over, np.unravel_index(number, self.shape), strict=True)) for number in numbers]
        try:
            cases = list(cases_of(result, places))
        except ParameterError:  # the case of a version that knew other keys
            return columns, solved
        ways = [_way_to_solve(number, case, near) for number, case in enumerate(cases)]
        before, after = self._beside(result, "zc")
        for way, number in dict.fromkeys(ways):
            if way is None:
                continue
            some = np.flatnonzero([ways[i] == (way, number) for i in which])
            found, good = way(
                [cases[i] for i in which[some]], met, value, {name: one[some] for name, one in near.items()}
            )
            for name, values in found.items():
                columns.setdefault(name, np.full((len(solved), *values.shape[1:]), np.nan))[some] = values
            solved[some] = good
        if solved.any() and "zc" in near:
            room = np.abs(after - before) + STRAY * columns["amplitude"][:, 0]
            solved[solved] = (np.abs(columns["zc"] - near["zc"]) <= room)[solved]
        return columns, solved

    def read(self, result: xr.Dataset, name: str) -> AnyArray:
        """Return a quantity on the straight lines between points; an angle goes the shorter way round."""
        before, after = self._beside(result, name)
        share = self.share.reshape(-1, *[1] * (before.ndim - 1))
        found = (1.0 - share) * before + share * after
        if result.variables[name].attrs.get("units") == "degree":
            highest, change = HIGHEST.get(name, 270.0), after - before
            short = before + share * (180.0 - (180.0 - change) % 360.0)
            found = np.where(np.abs(change) > 180.0, highest - (highest - short) % 360.0, found)
        return np.asarray(found)

    def _beside(self, result: xr.Dataset, name: str) -> list[AnyArray]:
        """Return a quantity at the points before and after each state."""
        values = by_case(result, name, self.row, self.over)
        return [values[self.case, self.way, place] for place in (self.before, self.after)]

    def laid_out(
        self, result: xr.Dataset, name: str, values: AnyArray
    ) -> tuple[tuple[str, ...], AnyArray, dict[Any, Any]]:
        """Return values of a quantity over the parameters and `crossing`, with their dimensions and attributes."""
        dims, table = self.table(values, np.nan)
        variable = result.variables[name]
        own = (str(dim) for dim in variable.dims if dim not in (self.row, "direction", *self.over))
        return (*dims, *own), table, dict(variable.attrs)


def _way_to_solve(number: int, case: Case, known: Collection[str]) -> tuple[Any, int]:
    """Return the function that solves states of curves of a case from guesses of some quantities; None where there is none.

    With it comes the number of the case, or 0 where it solves states of all cases together.
    """
    from dforce.procedures import branches, locked, operating, two_tones  # load the compiler

    if case.problem.is_locked and len(case.problem.tones) > 1:
        return two_tones.at_value if "zc" in known else None, number
    if case.problem.is_locked:
        return locked.at_value if set(known) >= set(GUESSES) else None, number
    if case.solver.method != "periodic" or REPEATS not in known:
        return None, 0
    if ENDS in known:
        return branches.at_value, number
    return operating.at_value if "zc" in known else None, 0
