"""The way in: a finder gives the steady motion of a problem, distance after distance, by the method asked for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dforce.kernel import Array
from dforce.problem import Problem
from dforce.solvers import SolverSettings
from dforce.solvers.integrator import INTEGRATORS, Integrator, Motion
from dforce.solvers.orbit import Follower
from dforce.solvers.transient import Steady, Watch, steady

SUDDEN = 0.02  # of the free amplitude: a settled motion that moves less from one distance to the next has not jumped


class Transient:
    """Integrates in time until the motion has settled, at one distance after another.

    Attributes
    ----------
    jumps
        The jumps met so far, between distances at which the motion has settled.
    """

    def __init__(self, integrator: Integrator) -> None:
        self.integrator = integrator
        self._follower = Follower(integrator)
        self.jumps = self._follower.jumps

    def along(self, motion: Motion, zc: Array, watch: Watch) -> Iterator[Steady]:
        """Give the steady motion at each distance (m), each started from the one before; end where it is lost."""
        return self.stretches(motion, zc, watch)

    def stretches(self, motion: Motion, zc: Array, watch: Watch, before: float | None = None) -> Iterator[Steady]:
        """Give the same; `before` is the distance at which the motion was found, where the distances continue others."""
        origin, way = motion, [] if before is None else [before]  # the last settled motion, the distances from it on
        for there in zc:
            self.integrator.place(float(there))
            found = steady(self.integrator, motion, watch)
            motion = found.motion
            if way:
                way.append(float(there))
            if found.settled and found.repeats:
                if way:
                    self.note_jump(origin, motion, np.array(way))
                origin, way = motion, [float(there)]
            yield found
            if not motion.is_finite:
                return

    def note_jump(self, before: Motion, after: Motion, zc: Array) -> None:
        """Note a jump between motions that have settled at the first of some distances and at the last, where the tip is.

        There is none where the orbit of the one leads to that of the other. Tones that never repeat together have no orbits.
        """
        if self._follower.common is None or np.abs(np.subtract(before.y, after.y)).max() < SUDDEN:
            return
        first = self._follower.home(after)
        self.integrator.place(float(zc[0]))
        if first is not None and self._follower.home(before) is not None:
            self._follower.note_jump(before, first, zc)


def make_finder(problem: Problem, settings: SolverSettings, harmonics: int) -> Transient | Follower:
    """Return the finder that the settings name, made ready for a problem."""
    integrator = INTEGRATORS[settings.integrator](problem, settings, harmonics)
    return Follower(integrator) if settings.method == "periodic" else Transient(integrator)
