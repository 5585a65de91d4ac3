"""A curve along a parameter: what approaches and frequency sweeps share."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from dforce.case import Case
from dforce.core import units
from dforce.core.arrays import Array
from dforce.core.quantities import MOTION, REPEATS
from dforce.core.stopping import until_stopped
from dforce.experiments.base import CurveExperiment, CurvePlan, Progress, initial_motions
from dforce.procedures.motion import COMPONENT, components, motions, states_of
from dforce.procedures.table import Table, statuses, with_levers
from dforce.results.status import REPEATING, Status
from dforce.solvers.accuracy import assure, assure_in_grace
from dforce.solvers.block import Block
from dforce.solvers.blocks import block_type
from dforce.solvers.points import Points, StateJump
from dforce.solvers.protocols import Settled, Stepwise, actual, make_protocol
from dforce.solvers.quasi_static_walk import CHUNK, Walk
from dforce.solvers.sample_counts import TooFewSamples, sample_counts
from dforce.solvers.states import States
from dforce.solvers.transient import never_cancelled

AT_ONCE = 256  # points whose accuracy is looked at together, where that takes milliseconds
PERIOD = "period"  # attribute of an interrupted result: in which period of the first tone its motion stands


def curve(case: Case, experiment: CurveExperiment, report_progress: Progress, earlier: xr.Dataset | None) -> xr.Dataset:
    """Return the motions along the curve of an experiment; see :func:`dforce.runs.carry_out`."""
    problem, harmonics = case.problem, experiment.harmonics
    plan, settings = experiment.plan(problem), experiment.solved_with(case.solver)
    zc = plan.zc
    if zc is None:
        found = PlannedCurve(
            lambda points: block_type(settings).of_one(problem, settings, harmonics, points=points),
            plan,
            lambda value: f"zc = {1e9 * value:.4g} nm",
        )
        data = found.run(report_progress, earlier)
        if problem.heights is None:
            return data
        return with_levers(data, "zc", [problem.at_height(float(value)) for value in data["zc"].values])
    there, lowest = problem.at_height(zc), float(plan.values.min())
    found = PlannedCurve(
        lambda points: block_type(settings).along_frequency(there, zc, lowest, settings, harmonics, points),
        plan,
        lambda value: f"frequency = {units.show(value, 'Hz', 6)}",
    )
    return found.run(report_progress, earlier).assign_coords(zc=zc)


class Solved(NamedTuple):
    """What was solved of a curve.

    Attributes
    ----------
    points, became, values
        Motion and status found at each visited value (SI).
    table
        Holds the points of an earlier result.
    begun, reached
        The visits between them are new.
    jumps
        Between states, those of the earlier result included.
    stopped_in
        Period of the first tone in which a stopped run ended; None of a whole curve.
    """

    points: Points
    became: np.ndarray[Any, np.dtype[np.int8]]
    values: Array
    table: Table
    begun: int
    reached: int
    jumps: list[StateJump]
    stopped_in: int | None


@dataclass
class PlannedCurve:
    """A curve to be solved.

    Attributes
    ----------
    make
        Makes the block of the one problem, with so many samples per period; None: as many as its settings ask for.
    plan
        Where it goes, and how.
    note
        Says where a value (SI) is, for people who wait.
    """

    make: Callable[[int | None], Block]
    plan: CurvePlan
    note: Callable[[float], str]
    block: Block = field(init=False)

    def run(self, progress: Progress, earlier: xr.Dataset | None) -> xr.Dataset:
        """Return the curve as a Dataset; what is there when it is stopped is kept."""
        return self._dataset(self.solve(progress, earlier), earlier)

    def solve(self, progress: Progress, earlier: xr.Dataset | None) -> Solved:
        """Solve the curve, with as many samples as it needs."""
        block, reached = self.make(None), 0 if earlier is None else int(earlier.attrs["samples_per_period"])
        for count, is_last in sample_counts(block.points, block.settings):
            if count < reached:
                continue
            self.block = block if count == block.points else self.make(count)
            with contextlib.suppress(TooFewSamples):
                return self._solve(progress, earlier if count == reached else None, not is_last)
        raise AssertionError("the last number of samples is final")

    def _solve(self, progress: Progress, earlier: xr.Dataset | None, may_refine: bool) -> Solved:
        """Solve the curve; raise TooFewSamples where more of them may help."""
        block, plan, coords = self.block, self.plan, self.plan.coords
        values = plan.values[[place[0] for place in plan.visits]]
        total, done, assured = len(values), 0, 0
        often = AT_ONCE if block.is_smooth else CHUNK  # so that a stop need not wait for long

        became = np.full(total, Status.NOT_COMPUTED, dtype=np.int8)

        def judge(end: int) -> slice:
            found = slice(assured, end)
            became[found] = statuses(solver.points[found], block, values[None, found])[0]
            return found

        def report_done(points: int) -> None:
            nonlocal done, assured
            done += points
            if done < total and done < assured + often:
                return
            assure(block, values[None, assured:done], solver.points[assured:done])
            found, assured = judge(done), done
            if may_refine and (became[found] == Status.UNRESOLVED).any():
                raise TooFewSamples

        def check_cancelled() -> None:
            # the last point is done once its accuracy is known: until then a stop need not wait
            progress(min(done, total - 1), total, self.note(float(values[min(done, total - 1)])))

        block.check_cancelled = check_cancelled
        [first] = initial_motions(block, values[:1], plan.start)
        solver = make_protocol(plan.protocol, block, values[None], [first], report_done, plan.carry)
        table = Table(tuple(coords), coords, block.batch.example, block.harmonics)
        kept: list[StateJump] = []
        if earlier is not None:
            taken = self._taken(earlier)
            if isinstance(solver, Walk):
                taken -= taken % CHUNK
            if taken:
                kept = self._resume(solver, table, earlier, taken, values)
                done = assured = taken
                if may_refine and (table.status == Status.UNRESOLVED).any():
                    raise TooFewSamples
        begun = done
        with until_stopped():
            check_cancelled()
            solver.run()
            progress(total, total, "")
        reached = int(solver.done[0])
        checked = assured + assure_in_grace(block, values[None, assured:reached], solver.points[assured:reached])
        judge(reached)
        block.check_cancelled = never_cancelled
        period = solver.motions[0].period if isinstance(solver, Stepwise) else 0
        stopped_in = period if min(checked, reached) < total else None
        return Solved(solver.points, became, values, table, begun, reached, kept + solver.jumps[0], stopped_in)

    def _dataset(self, solved: Solved, earlier: xr.Dataset | None) -> xr.Dataset:
        """Return what was solved as a Dataset."""
        block, table, begun, reached = self.block, solved.table, solved.begun, solved.reached
        new = slice(begun, reached)
        table.put_points(self.plan.visits[new], solved.points, solved.became[new], new, block, solved.values)
        kept_motions = self._motions(solved.points, table, begun, reached, solved.values, earlier)
        data = table.dataset(self._jumps(solved.jumps) | kept_motions, components(block.batch.example))
        data.attrs |= {"samples_per_period": block.points, "protocol": actual(self.plan.protocol, block)}
        if solved.stopped_in is not None:
            data.attrs |= {"interrupted": 1, PERIOD: solved.stopped_in}
        return data

    def _taken(self, earlier: xr.Dataset) -> int:
        """Return how many points an interrupted result has, up to the first whose accuracy is not known."""
        left = earlier["status"].values == Status.NOT_COMPUTED
        if "error_estimate" in earlier:  # of orbits alone
            left |= (earlier["status"].values == Status.INACCURATE) & np.isnan(earlier["error_estimate"].values)
        return next((number for number, place in enumerate(self.plan.visits) if left[place]), len(self.plan.visits))

    def _resume(self, solver: Any, table: Table, earlier: xr.Dataset, taken: int, values: Array) -> list[StateJump]:
        """Take over points of an interrupted result, and the motion at the last of them; return the jumps before it."""
        table.take_over(earlier, self.plan.visits[:taken])
        place, last, state = self.plan.visits[taken - 1], values[taken - 1], self._state(earlier, taken - 1, values)
        if isinstance(solver, Walk):
            repeats = earlier[REPEATS].values[place]
            cycles = int(repeats) // self.block.common if np.isfinite(repeats) else 0
            solver.state.put(np.array([0]), state)
            solver.go_on_from(taken, cycles, float(earlier["amplitude"].values[place][0]))
        else:
            motion = replace(state.motion(0), period=int(earlier.attrs.get(PERIOD, 0)))
            solver.go_on_from(taken, motion, self._last_settled(earlier, taken, values))
        if self._names()[0] not in earlier:
            return []
        rows = zip(*(earlier[name].values for name in self._names()), strict=True)
        jumps = [
            StateJump(float(at), float(before), float(after), way == self.plan.ways[1])
            for at, before, after, way in rows
        ]

        def is_before(jump: StateJump) -> bool:
            if len(place) > 1 and self.plan.directions[place[1]] != self.plan.ways[jump.rising]:
                return place[1] == 1  # on the way there, and the motion is on its way back
            return bool(jump.at <= last if jump.rising else jump.at >= last)

        return [jump for jump in jumps if is_before(jump)]

    def _state(self, earlier: xr.Dataset, number: int, values: Array) -> States:
        """Return the state that an earlier result has at one of the values."""
        which, at = np.array([0]), values[number : number + 1]
        scales, base = self.block.scales_of(which, at), self.block.base_of(which, at)
        return states_of(earlier[MOTION].values[self.plan.visits[number]][None], self.block.batch.example, scales, base)

    def _last_settled(self, earlier: xr.Dataset, taken: int, values: Array) -> Settled | None:
        """Return the last motion that had settled, which a jump is noted from."""
        status, amplitude = earlier["status"].values, earlier["amplitude"].values
        numbers = [number for number in range(taken) if status[self.plan.visits[number]] in REPEATING]
        if not numbers:
            return None
        motion = self._state(earlier, numbers[-1], values).motion(0)
        return Settled(motion, float(values[numbers[-1]]), float(amplitude[self.plan.visits[numbers[-1]]][0]))

    def _names(self) -> list[str]:
        return [f"jump_{self.plan.name}", "jump_before", "jump_after", "jump_direction"]

    def _jumps(self, jumps: list[StateJump]) -> dict[str, Any]:
        """Return the variables that hold the jumps; nothing where there are none."""
        if not jumps:
            return {}
        columns = zip(*((jump.at, jump.before, jump.after, self.plan.ways[jump.rising]) for jump in jumps), strict=True)
        return {name: ("jump", list(column)) for name, column in zip(self._names(), columns, strict=True)}

    def _motions(
        self, points: Any, table: Table, begun: int, reached: int, values: Array, earlier: xr.Dataset | None
    ) -> dict[str, Any]:
        """Return the variables that hold the motion at the start of a common period at each point."""
        found = motions(points, self.block, values[None])
        rows, cycles = found[MOTION][0], found[REPEATS][0]
        motion = np.full((*table.shape, rows.shape[1]), np.nan)
        repeats = np.full(table.shape, np.nan)
        if earlier is not None and begun:
            before = tuple(np.array(self.plan.visits[:begun]).T)
            motion[before], repeats[before] = earlier[MOTION].values[before], earlier[REPEATS].values[before]
        if reached > begun:
            here = tuple(np.array(self.plan.visits[begun:reached]).T)
            motion[here], repeats[here] = rows[begun:reached], cycles[begun:reached]
        return {MOTION: ((*table.dims, COMPONENT), motion), REPEATS: (table.dims, repeats)}
