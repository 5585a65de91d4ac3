"""A curve along a parameter: what approaches and frequency sweeps share."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.quantities import MOTION, REPEATS
from dforce.core.stopping import heard
from dforce.experiments.base import Progress, Start, initial_motions
from dforce.experiments.motion import COMPONENT, components, motions, states_of
from dforce.experiments.table import Table
from dforce.results.status import REPEATING, Status

if TYPE_CHECKING:
    import xarray as xr

    from dforce.kernel import Array
    from dforce.solvers.block import Block
    from dforce.solvers.points import Jump
    from dforce.solvers.protocols import Settled
    from dforce.solvers.states import States

Place = tuple[int, ...]
AT_ONCE = 256  # points whose accuracy is looked at together, where that takes milliseconds
PERIOD = "period"  # attribute of an interrupted result: in which period of the first tone its motion stands


@dataclass
class Curve:
    """A curve to be solved.

    Attributes
    ----------
    make
        Makes the block of the one problem, with so many samples per period; None: as many as its settings ask for.
    coords
        Coordinates of the result: the values of the parameter, then the directions if there are two.
    visits
        Places of the result in the order in which the parameter comes to them.
    protocol, carry, start
        How the motion is carried along, and where it starts.
    at_jump
        Name of the parameter's value at jumps.
    ways
        Names of the directions in which the parameter falls and rises.
    note
        Says where a value (SI) is, for people who wait.
    """

    make: Callable[[int | None], Block]
    coords: dict[str, Any]
    visits: list[Place]
    protocol: str
    carry: bool
    start: Start
    at_jump: str
    ways: tuple[str, str]
    note: Callable[[float], str]
    block: Block = field(init=False)

    def run(self, progress: Progress, earlier: xr.Dataset | None) -> xr.Dataset:
        """Return the curve as a Dataset; what is there when it is stopped is kept."""
        from dforce.solvers.sample_counts import TooFewSamples, sample_counts

        block, reached = self.make(None), 0 if earlier is None else int(earlier.attrs["samples_per_period"])
        for count, is_last in sample_counts(block.points, block.settings):
            if count < reached:
                continue
            self.block = block if count == block.points else self.make(count)
            with contextlib.suppress(TooFewSamples):
                return self._run(progress, earlier if count == reached else None, not is_last)
        raise AssertionError("the last number of samples is final")

    def _run(self, progress: Progress, earlier: xr.Dataset | None, may_refine: bool) -> xr.Dataset:
        """Return the curve; raise TooFewSamples where more of them may help."""
        from dforce.experiments.table import statuses
        from dforce.solvers.accuracy import assure, assure_in_grace
        from dforce.solvers.protocols import Stepwise, actual, make_protocol
        from dforce.solvers.quasi_static_walk import CHUNK, Walk
        from dforce.solvers.sample_counts import TooFewSamples
        from dforce.solvers.transient import unwatched

        block = self.block
        values = np.array([next(iter(self.coords.values()))[place[0]] for place in self.visits])
        total, done, assured = len(values), 0, 0
        often = AT_ONCE if block.is_smooth else CHUNK  # so that a stop need not wait for long

        def assure_to(end: int) -> slice:
            nonlocal assured
            found = slice(assured, end)
            assure(block, values[None, found], solver.points[found])
            assured = end
            return found

        def told(points: int) -> None:
            nonlocal done
            done += points
            if done < total and done < assured + often:
                return
            found = assure_to(done)
            if may_refine and (statuses(solver.points[found], block, values[None, found]) == Status.UNRESOLVED).any():
                raise TooFewSamples

        def watch() -> None:
            # the last point is done once its accuracy is known: until then a stop need not wait
            progress(min(done, total - 1), total, self.note(float(values[min(done, total - 1)])))

        block.watch = watch
        [first] = initial_motions(block, values[:1], self.start)
        solver = make_protocol(self.protocol, block, values[None], [first], told, self.carry)
        table = Table(tuple(self.coords), self.coords, block.lot.example, block.harmonics)
        kept: list[Jump] = []
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
        try:
            watch()
            solver.run()
            progress(total, total, "")
        except KeyboardInterrupt:
            heard()
        reached = int(solver.done[0])
        checked = assured + assure_in_grace(block, values[None, assured:reached], solver.points[assured:reached])
        block.watch = unwatched
        table.put_points(self.visits[begun:reached], solver.points, slice(begun, reached), block, values)
        for place in self.visits[reached:]:
            table.status[place] = Status.NOT_COMPUTED
        kept_motions = self._motions(solver.points, table, begun, reached, values, earlier)
        data = table.dataset(self._jumps(kept + solver.jumps[0]) | kept_motions, components(block.lot.example))
        data.attrs |= {"samples_per_period": block.points, "protocol": actual(self.protocol, block)}
        if min(checked, reached) < total:
            period = solver.motions[0].period if isinstance(solver, Stepwise) else 0
            data.attrs |= {"interrupted": 1, PERIOD: period}
        return data

    def _taken(self, earlier: xr.Dataset) -> int:
        """Return how many points an interrupted result has, up to the first whose accuracy is not known."""
        left = earlier["status"].values == Status.NOT_COMPUTED
        if "error_estimate" in earlier:  # of orbits alone
            left |= (earlier["status"].values == Status.INACCURATE) & np.isnan(earlier["error_estimate"].values)
        return next((number for number, place in enumerate(self.visits) if left[place]), len(self.visits))

    def _resume(self, solver: Any, table: Table, earlier: xr.Dataset, taken: int, values: Array) -> list[Jump]:
        """Take over points of an interrupted result, and the motion at the last of them; return the jumps before it."""
        from dforce.solvers.points import Jump
        from dforce.solvers.quasi_static_walk import Walk

        table.take_over(earlier, self.visits[:taken])
        place, last, state = self.visits[taken - 1], values[taken - 1], self._state(earlier, taken - 1, values)
        if isinstance(solver, Walk):
            repeats = earlier[REPEATS].values[place]
            cycles = int(repeats) // self.block.common if np.isfinite(repeats) else 0
            solver.state.put(np.array([0]), state)
            solver.go_on_from(taken, cycles, float(earlier["amplitude"].values[place][0]))
        else:
            motion = replace(state.motion(0), period=int(earlier.attrs.get(PERIOD, 0)))
            solver.go_on_from(taken, motion, self._last_settled(earlier, taken, values))
        if self.at_jump not in earlier:
            return []
        rows = zip(*(earlier[name].values for name in self._names()), strict=True)
        jumps = [Jump(float(at), float(before), float(after), way == self.ways[1]) for at, before, after, way in rows]

        def is_before(jump: Jump) -> bool:
            if len(place) > 1 and self.coords["direction"][place[1]] != self.ways[jump.rising]:
                return place[1] == 1  # on the way there, and the motion is on its way back
            return bool(jump.at <= last if jump.rising else jump.at >= last)

        return [jump for jump in jumps if is_before(jump)]

    def _state(self, earlier: xr.Dataset, number: int, values: Array) -> States:
        """Return the state that an earlier result has at one of the values."""
        which, at = np.array([0]), values[number : number + 1]
        scales, base = self.block.scales_of(which, at), self.block.base_of(which, at)
        return states_of(earlier[MOTION].values[self.visits[number]][None], self.block.lot.example, scales, base)

    def _last_settled(self, earlier: xr.Dataset, taken: int, values: Array) -> Settled | None:
        """Return the last motion that had settled, which a jump is noted from."""
        from dforce.solvers.protocols import Settled

        status, amplitude = earlier["status"].values, earlier["amplitude"].values
        numbers = [number for number in range(taken) if status[self.visits[number]] in REPEATING]
        if not numbers:
            return None
        motion = self._state(earlier, numbers[-1], values).motion(0)
        return Settled(motion, float(values[numbers[-1]]), float(amplitude[self.visits[numbers[-1]]][0]))

    def _names(self) -> list[str]:
        return [self.at_jump, "jump_before", "jump_after", "jump_direction"]

    def _jumps(self, jumps: list[Jump]) -> dict[str, Any]:
        """Return the variables that hold the jumps; nothing where there are none."""
        if not jumps:
            return {}
        columns = zip(*((jump.at, jump.before, jump.after, self.ways[jump.rising]) for jump in jumps), strict=True)
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
            before = tuple(np.array(self.visits[:begun]).T)
            motion[before], repeats[before] = earlier[MOTION].values[before], earlier[REPEATS].values[before]
        if reached > begun:
            here = tuple(np.array(self.visits[begun:reached]).T)
            motion[here], repeats[here] = rows[begun:reached], cycles[begun:reached]
        return {MOTION: ((*table.dims, COMPONENT), motion), REPEATS: (table.dims, repeats)}
