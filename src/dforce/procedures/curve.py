"""A curve along a parameter: the common part of approaches and frequency sweeps."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

from dforce.case import Case
from dforce.core import units
from dforce.core.arrays import AnyArray, Array
from dforce.core.quantities import MOTION, REPEATS
from dforce.core.stopping import until_stopped
from dforce.experiments.base import CurveExperiment, CurvePlan, Progress, initial_motions
from dforce.procedures import locked
from dforce.procedures.found import Found, Layout, dataset, split, with_levers
from dforce.procedures.motion import motions, states_of
from dforce.procedures.statuses import need_samples, statuses, without_failed
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
PERIOD = "period"  # attribute of an interrupted result: the period of the first tone at its motion


def curve(case: Case, experiment: CurveExperiment, report_progress: Progress, earlier: xr.Dataset | None) -> xr.Dataset:
    """Return the motions along the curve of an experiment; see :func:`dforce.runs.carry_out`."""
    problem, harmonics = case.problem, experiment.harmonics
    if problem.is_locked:
        from dforce.procedures import two_tones  # loads the compiler

        solve = two_tones.curve if len(problem.tones) > 1 else locked.curve
        return solve(case, experiment, report_progress, earlier)
    plan, settings = experiment.plan(problem), experiment.solved_with(case.solver)
    blocks, zc = block_type(settings), plan.zc
    if zc is None:
        found = PlannedCurve(plan, lambda points: blocks.of_one(problem, settings, harmonics, points=points))
        data = found.run(report_progress, earlier)
        if problem.heights is None:
            return data
        return with_levers(data, "zc", [problem.at_height(float(value)) for value in data["zc"].values])
    there, lowest = problem.at_height(zc), float(plan.values.min())
    found = PlannedCurve(plan, lambda points: blocks.along_frequency(there, zc, lowest, settings, harmonics, points))
    return found.run(report_progress, earlier).assign_coords(zc=zc)


@dataclass
class PlannedCurve:
    """A curve to be solved.

    Attributes
    ----------
    plan
        Where it goes, and how.
    make
        Makes the block of the one problem, with so many samples per period; None: as many as its settings ask for.
    """

    plan: CurvePlan
    make: Callable[[int | None], Block]
    block: Block = field(init=False)

    def __post_init__(self) -> None:
        self.layout = Layout([self.plan], self.plan.coords)

    def run(self, progress: Progress, earlier: xr.Dataset | None) -> xr.Dataset:
        """Return the curve as a Dataset; after a stop, with its finished points."""
        found, stopped_in = self.solve(progress, earlier)
        data, block = dataset(self.layout, [found], self.block.batch.example), self.block
        data.attrs |= {"samples_per_period": block.points, "protocol": actual(self.plan.protocol, block)}
        return data if stopped_in is None else data.assign_attrs({"interrupted": 1, PERIOD: stopped_in})

    def solve(self, progress: Progress, earlier: xr.Dataset | None) -> tuple[Found, int | None]:
        """Solve the curve, with as many samples as it needs.

        With it comes the period of the first tone in which a stopped run ended; None of a whole curve.
        """
        block, reached = self.make(None), 0 if earlier is None else int(earlier.attrs["samples_per_period"])
        counts = sample_counts(block.points, block.settings)
        for count in (count for count in counts if count >= reached):
            self.block = block if count == block.points else self.make(count)
            with contextlib.suppress(TooFewSamples):
                return self._solve(progress, earlier if count == reached else None, count < counts[-1])
        raise AssertionError("the last number of samples is final")

    def _solve(self, progress: Progress, earlier: xr.Dataset | None, may_refine: bool) -> tuple[Found, int | None]:
        """Solve the curve; raise TooFewSamples where more of them may help."""
        block, plan = self.block, self.plan
        values = plan.values[[place[0] for place in plan.visits]]
        total, done, assured, unit = len(values), 0, 0, "m" if plan.zc is None else "Hz"
        often = AT_ONCE if block.is_smooth else CHUNK  # so that a stop need not wait for long

        became = np.full(total, Status.NOT_COMPUTED, dtype=np.int8)

        def judge(end: int) -> slice:
            found = slice(assured, end)
            became[found] = statuses(solver.points[found], block, values[None, found])[0]
            return found

        def report_done(points: int) -> None:
            nonlocal done, assured, may_refine
            done += points
            if done < total and done < assured + often:
                return
            assure(block, values[None, assured:done], solver.points[assured:done])
            found, assured = judge(done), done
            if may_refine and (became[found] == Status.UNRESOLVED).any():
                if need_samples(solver.points[found], became[None, found])[0]:
                    raise TooFewSamples
                may_refine = False

        def check_cancelled() -> None:
            # the last point is done once its accuracy is known: until then a stop need not wait
            place = min(done, total - 1)
            progress(place, total, f"{plan.name} = {units.show(float(values[place]), unit, 6)}")

        block.check_cancelled = check_cancelled
        [first] = initial_motions(block, values[:1], plan.start)
        solver = make_protocol(plan.protocol, block, values[None], [first], report_done, plan.carry)
        kept = Found.empty(1, total) if earlier is None else split(earlier, self.layout)[0]
        begun = done = assured = self._take(kept, 1 if isinstance(solver, Stepwise) else CHUNK, values)
        if earlier is not None and begun:
            self._go_on(solver, kept, begun, values, int(earlier.attrs.get(PERIOD, 0)))
        with until_stopped():
            check_cancelled()
            solver.run()
            progress(total, total, "")
        reached = int(solver.done[0])
        checked = assured + assure_in_grace(block, values[None, assured:reached], solver.points[assured:reached])
        judge(reached)
        block.check_cancelled = never_cancelled
        period = solver.motions[0].period if isinstance(solver, Stepwise) else 0
        if reached > begun:
            self._keep(kept, slice(begun, reached), solver.points, became, values)
        kept.jumps[0] += solver.jumps[0]
        return kept, period if min(checked, reached) < total else None

    def _keep(self, kept: Found, new: slice, points: Points, became: AnyArray, values: Array) -> None:
        """Keep new points; after a stop the last points have no errors yet."""
        columns, of_points = points.columns(self.block, values[None]), motions(points, self.block, values[None])
        if self.block.settings.accuracy is not None:
            unknown = (points.is_orbit & np.isnan(points.error))[0]
            became = np.where(unknown & (became == Status.OK), Status.INACCURATE, became)
        found = without_failed({name: column[0, new] for name, column in columns.items()}, became[new])
        # a run goes on from the motion of a failed point, too
        kept.keep((0, new), found | {name: column[0, new] for name, column in of_points.items()}, became[new])

    def _take(self, kept: Found, multiple: int, values: Array) -> int:
        """Keep of an earlier result the points up to the first whose accuracy is not known, or that more samples may resolve.

        Return how many these are.

        None of a curve whose way back takes over points of the way there: it needs more of them than a result keeps.
        """
        left = np.isin(kept.status[0], (Status.NOT_COMPUTED, Status.UNRESOLVED))
        left |= multiple > 1 and self.block.is_smooth and len(self.plan.directions) > 1
        if "error_estimate" in kept.arrays:  # of orbits alone
            left |= (kept.status[0] == Status.INACCURATE) & np.isnan(kept.arrays["error_estimate"][0])
        taken = int(np.argmax(np.append(left, True)))
        taken -= taken % multiple
        kept.status[0, taken:] = Status.NOT_COMPUTED
        for array in kept.arrays.values():
            array[0, taken:] = np.nan
        place, last = self.plan.visits[taken - 1], values[taken - 1]

        def is_before(jump: StateJump) -> bool:
            if len(place) > 1 and self.plan.directions[place[1]] != self.plan.ways[jump.rising]:
                return place[1] == 1  # on the way there, and the motion is on its way back
            return bool(jump.at <= last if jump.rising else jump.at >= last)

        kept.jumps[0] = [jump for jump in kept.jumps[0] if taken and is_before(jump)]
        return taken

    def _go_on(self, solver: Any, kept: Found, taken: int, values: Array, period: int) -> None:
        """Let a solver go on from the last of the points taken."""
        state = self._state(kept, taken - 1, values)
        if isinstance(solver, Walk):
            repeats = float(kept.arrays[REPEATS][0, taken - 1])
            cycles = int(repeats) // self.block.common if np.isfinite(repeats) else 0
            solver.state.put(np.array([0]), state)
            solver.go_on_from(taken, cycles, float(kept.arrays["amplitude"][0, taken - 1, 0]))
        else:
            motion = replace(state.motion(0), period=period)
            solver.go_on_from(taken, motion, self._last_settled(kept, taken, values))

    def _state(self, kept: Found, number: int, values: Array) -> States:
        """Return the state that was kept at one of the values."""
        which, at = np.array([0]), values[number : number + 1]
        scales, base = self.block.scales_of(which, at), self.block.base_of(which, at)
        return states_of(kept.arrays[MOTION][:, number], self.block.batch.example, scales, base)

    def _last_settled(self, kept: Found, taken: int, values: Array) -> Settled | None:
        """Return the last motion that had settled, which a jump is noted from."""
        numbers = np.flatnonzero(np.isin(kept.status[0, :taken], REPEATING))
        if not len(numbers):
            return None
        last = int(numbers[-1])
        amplitude = float(kept.arrays["amplitude"][0, last, 0])
        return Settled(self._state(kept, last, values).motion(0), float(values[last]), amplitude)
