"""Locked motions that controllers find in time, for any forces."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.experiments.base import initial_motion
from dforce.observables.averaging import weights
from dforce.observables.finish import finish
from dforce.procedures.locked import of_locks
from dforce.procedures.statuses import status_of, without_failed
from dforce.results.status import Status
from dforce.solvers.controlled import ControlledMotion, ToneControllers, follow
from dforce.solvers.integrator import INTEGRATORS, Integrator, Motion
from dforce.solvers.transient import Steady

if TYPE_CHECKING:
    from collections.abc import Callable

    from dforce.core.arrays import Array
    from dforce.problem import Problem
    from dforce.solvers import SolverSettings

STEP = 0.1  # of the set point of the first tone, by which the distance changes in a window


class InTime:
    """The locked motions of a problem along the distance, each found in time from the motion before.

    Parameters
    ----------
    problem
        A problem of several tones; at least one has a lock. Its frequencies are the frequencies of the free locks.
    zc, there, ratio, motion
        The start: a distance (m), the problem with other frequencies and drives, and these drives as multiples of the drives
        at the free locks. Last a motion scaled as this problem; None: the free motion.

    Attributes
    ----------
    integrator, motion
        The last motion; the integrator's problem has its frequencies and drives.
    """

    def __init__(
        self,
        problem: Problem,
        settings: SolverSettings,
        report: Callable[..., None],
        zc: float,
        there: Problem,
        ratio: Array,
        motion: Motion | None,
    ) -> None:
        self.problem, self.settings, self.report = problem, settings, report
        self._begin(zc, there, ratio, motion)

    def _begin(self, zc: float, there: Problem, ratio: Array, motion: Motion | None) -> None:
        self.zc, self.ratio = zc, ratio
        self.integrator = INTEGRATORS[self.settings.integrator](there, self.settings, 0)
        self.motion = motion or initial_motion(self.integrator, "free")

    def at(self, zc: float) -> tuple[dict[str, Any], Status]:
        """Go to a distance (m); return the observables there and the status."""
        if not self.motion.is_finite:  # it failed
            self._begin(self.zc, self.problem.unlocked, np.ones(len(self.problem.tones)), None)
        steps = math.ceil(abs(zc - self.zc) / (STEP * self.problem.tones[0].A0)) + 1
        way = np.linspace(self.zc, zc, steps)[1:].tolist() or [zc]
        loops = [ToneControllers.of(tone) for tone in self.problem.tones]
        followed = follow(self.integrator, way, self.motion, loops, self.report)
        self.zc, self.ratio, self.motion = zc, self.ratio * followed.ratio[-1], followed.motion
        found = measured(self.problem, self.integrator, followed, self.ratio, followed.rows)
        became = status_of(found, self.integrator.problem)
        return without_failed(found.values, became), became


def measured(problem: Problem, integrator: Integrator, followed: ControlledMotion, ratio: Array, rows: Array) -> Steady:
    """Return the observables of rows measured in the end; `ratio` are the drives as multiples of the free lock's."""
    frequency = followed.frequency[-1:]
    even = weights(frequency[0].tolist(), len(rows))
    values = finish(integrator.problem, integrator.harmonics, rows, even)
    each = {name: np.asarray(value)[None] for name, value in values.items()}
    values |= {name: value[0] for name, value in of_locks(problem, frequency, ratio[None], each).items()}
    values["settling_periods"] = float(followed.periods)
    return Steady(values, followed.motion, followed.settled, followed.repeats)
