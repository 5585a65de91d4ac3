"""The way in: a finder gives the steady motion of a problem, distance after distance, by the method asked for."""

from __future__ import annotations

from collections.abc import Iterator

from dforce.kernel import Array
from dforce.problem import Problem
from dforce.solvers import SolverSettings
from dforce.solvers.integrator import INTEGRATORS, Integrator, Motion
from dforce.solvers.orbit import Follower, Jump
from dforce.solvers.transient import Steady, Watch, steady


class Transient:
    """Integrates in time until the motion has settled, at one distance after another."""

    def __init__(self, integrator: Integrator) -> None:
        self.integrator = integrator
        self.jumps: list[Jump] = []

    def along(self, motion: Motion, zc: Array, watch: Watch) -> Iterator[Steady]:
        """Give the steady motion at each distance (m), each started from the one before; end where it is lost."""
        for distance in zc:
            self.integrator.place(float(distance))
            found = steady(self.integrator, motion, watch)
            yield found
            motion = found.motion
            if not motion.is_finite:
                return

    def stretches(self, motion: Motion, zc: Array, watch: Watch, before: float | None = None) -> Iterator[Steady]:
        """Give the same; `before`, the distance at which the motion was found, makes no difference to a transient."""
        return self.along(motion, zc, watch)


def make_finder(problem: Problem, settings: SolverSettings, harmonics: int) -> Transient | Follower:
    """Return the finder that the settings name, made ready for a problem."""
    integrator = INTEGRATORS[settings.integrator](problem, settings, harmonics)
    return Follower(integrator) if settings.method == "periodic" else Transient(integrator)
