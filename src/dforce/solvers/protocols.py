"""How a motion is carried from one value of a parameter to the next: slowly, or by sudden steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dforce.core.arrays import Array
from dforce.solvers.accuracy import assure, assure_settled, unless_stuck
from dforce.solvers.block import Block
from dforce.solvers.integrator import Motion
from dforce.solvers.points import Points, StateJump, as_kept
from dforce.solvers.quasi_static_walk import SUDDEN, Walk
from dforce.solvers.sample_counts import sample_counts
from dforce.solvers.settling import apart
from dforce.solvers.state_ends import JUMP
from dforce.solvers.states import States
from dforce.solvers.transient import Steady, steady

QUASI_STATIC, STEPWISE = "quasi_static", "stepwise"


def actual(protocol: str, block: Block) -> str:
    """Return the protocol that a run can follow: a transient, and tones that never repeat together, go by steps."""
    return protocol if block.is_periodic else STEPWISE


def make_protocol(
    protocol: str,
    block: Block,
    values: Array,
    starts: list[Motion],
    report_done: Callable[[int], None],
    carry: bool = True,
) -> Walk | Stepwise:
    """Return the protocol made ready for a block, along values (problems, values), from a start for each problem."""
    if actual(protocol, block) == STEPWISE:
        return Stepwise(block, values, starts, report_done, carry)
    return Walk(block, values, States.of(*starts), report_done)


@dataclass(frozen=True)
class Settled:
    """A settled motion that repeats: at which value of the parameter (SI), and its amplitude (m)."""

    motion: Motion
    value: float
    amplitude: float


class Stepwise:
    """Each point from the motion at the one before, after a sudden step: place, settle, measure.

    With `carry` off each point starts from the start again. Attributes as of `Walk`.
    """

    def __init__(
        self, block: Block, values: Array, starts: list[Motion], report_done: Callable[[int], None], carry: bool
    ) -> None:
        self.block, self.values, self.starts, self.report_done, self.carry = block, values, starts, report_done, carry
        self.points = Points.empty(block, values.shape[1])
        self.jumps: list[list[StateJump]] = [[] for _ in values]
        self.motions: list[Motion] = list(starts)
        self.settled: list[Settled | None] = [None] * len(starts)
        self.done = np.zeros(len(values), np.int64)

    def go_on_from(self, done: int, motion: Motion, settled: Settled | None) -> None:
        """Go on with the motion of the only problem at the value before place `done`, and the last settled motion."""
        self.done[:], self.motions, self.settled = done, [motion], [settled]

    def run(self) -> None:
        """Find the steady motions at all values that are left."""
        for case in range(len(self.values)):
            block = self.block.one(case)
            while self.done[case] < self.values.shape[1]:
                self.block.check_cancelled()
                self._step(block, case, int(self.done[case]))
                self.done[case] += 1
                self.report_done(1)

    def _step(self, block: Block, case: int, place: int) -> None:
        value, points = float(self.values[case, place]), self.points
        motion = self.motions[case] if self.carry and self.motions[case].is_finite else self.starts[case]
        if block.is_periodic:
            walk = Walk(block, np.array([[value]]), States.of(motion), lambda _: None)
            walk.run()
            assure(block, walk.values, walk.points)  # at once: the amplitude of its point shows a jump
            points.put(case, place, walk.points)
            motion = walk.state.motion(0)
        else:
            found = steady(block.integrator(0, value), motion, block.check_cancelled)
            if len(sample_counts(block.points, block.settings)) > 1:
                was_stuck = self.carry and place > 0 and bool(points.stays[case, place - 1])
                found = unless_stuck(block, value, found, was_stuck)
            found = assure_settled(block, value, found)
            points.put_other(case, place, found)
            motion = found.motion
        kept = as_kept(block, np.array([0]), States.of(motion), np.array([value])).motion(0)
        if points.is_settled(case, place):
            now, before = Settled(kept, value, points.amplitude(block, case, place, value)), self.settled[case]
            if self.carry and before is not None:
                self._note_jump(block, case, before, now)
            self.settled[case] = now
        self.motions[case] = replace(kept, period=motion.period)

    def _note_jump(self, block: Block, case: int, before: Settled, now: Settled) -> None:
        """Note a jump where the state that was the last to settle does not lead to the one found."""
        old, new = States.of(before.motion), States.of(now.motion)
        if not block.repeats_together or apart(old.x, new.x)[0] < SUDDEN:
            return
        found = block.follow(np.array([0]), old, np.array([before.value]), np.array([[now.value]]))
        if found.done[0] == 0 or apart(found.last_x, new.x)[0] > JUMP:
            rising = now.value > before.value
            self.jumps[case].append(StateJump(now.value, before.amplitude, now.amplitude, rising))


def settle_at(block: Block, motion: Motion, value: float) -> Steady:
    """Return the steady motion that settles from a given one at a value of the parameter."""
    stepwise = Stepwise(block, np.array([[value]]), [motion], lambda _: None, True)
    stepwise.run()
    assure(block, stepwise.values, stepwise.points)
    return stepwise.points.steady(block, 0, 0, value)
