"""The steady motion along a parameter as an experiment finds it: carried from value to value, jumps and all.

Where the orbit of the value before goes on and is stable, Newton's method gives it at once, unless the step kicks the
motion so hard that it may go elsewhere: then the motion is looked at, see ``kicks``. Where the orbit is lost, or the motion
leaves it, the transient from the last motion decides, as it would on an instrument.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dforce.kernel import Array
from dforce.solvers.fixed_point import Orbit, PeriodMap, along_parameter, as_steady, correct, orbit_from
from dforce.solvers.integrator import Integrator, Motion
from dforce.solvers.kicks import LARGE, NEAR, SMALL
from dforce.solvers.orbit import MISS, ROUGH, SAME_STATE, Follower
from dforce.solvers.shooting import AT_ONCE, PERIODS
from dforce.solvers.transient import Steady, Watch, settle, steady

ORDER = 2  # of the extrapolation that predicts the next orbit
EXPECTED = 0.05  # of the free amplitude: an orbit farther from its prediction may be another state


class Response:
    """Carries the motion of one tone through values of a parameter; several tones settle in time at each.

    Parameters
    ----------
    integrator
        Integrates one problem after another of the same kind.
    place
        Puts the integrator at a value (SI) of the parameter.
    low, high
        Range of the parameter (SI).
    """

    def __init__(self, integrator: Integrator, place: Callable[[float], None], low: float, high: float) -> None:
        self.integrator, self._place = integrator, place
        self._map: PeriodMap | None = None
        if integrator.settings.method == "periodic" and len(integrator.problem.tones) == 1:
            self._map = PeriodMap(integrator, place, low, max(high, low * (1.0 + 1e-9)))
        self._orbits: list[Orbit] = []  # the last ones without a transient in between
        self._motion: Motion | None = None
        self._value = 0.0

    def go(self, value: float) -> None:
        """Go to a value (SI) of the parameter; a motion carried along keeps its velocity."""
        before = self.integrator.scales.speed
        if self._map is None:
            self._place(value)
        else:
            self._value = value / self._map.span
            self._map.put(self._value)
        if self._motion is not None:
            y = np.array(self._motion.y)
            y[1::2] *= before / self.integrator.scales.speed
            self._motion = replace(self._motion, y=tuple(map(float, y)))

    def take_up(self, motion: Motion) -> None:
        """Go on from a motion that was found at this value before."""
        self._motion = motion if motion.is_finite else None
        near = None if self._map is None else self._orbit(self._map, motion, AT_ONCE)
        if self._map is not None and near is not None:
            self._kept(self._map, near)

    def carried(self, watch: Watch) -> Steady:
        """Return the steady motion that follows from the one at the value before."""
        watch()
        if self._map is not None and self._orbits:
            last, guess = self._orbits[-1], self._predicted()
            across = along_parameter(self._map.size)
            found = correct(self._map, guess, across, last.latched, (last.jacobian, last.slope))
            if found is not None and found.is_stable and np.abs(found.u - guess).max() < EXPECTED:
                if self._motion is None or self._stays(self._map, self._motion, found):
                    return self._kept(self._map, found)
                return self.settled(self._motion, watch, doubt=True)
        if self._motion is None:
            raise RuntimeError("there is no motion to carry")
        return self.settled(self._motion, watch)

    def _stays(self, period_map: PeriodMap, motion: Motion, orbit: Orbit) -> bool:
        """Say whether the motion of the value before settles on the orbit that continues it."""
        hardest, x = 0.0, period_map.state(motion)
        for _ in range(PERIODS):
            end = period_map.end(x, motion.latched)
            hardest, x = max(hardest, kick(x, end, orbit)), end
        if hardest < NEAR:
            return True
        goal = period_map.motion(orbit.u[:-1], orbit.latched)
        return Follower(self.integrator).home(motion, goal) is not None

    def settled(self, motion: Motion, watch: Watch, doubt: bool = False) -> Steady:
        """Return the steady motion that settles from a given one; of an orbit near it there may be `doubt`."""
        integrator, period_map = self.integrator, self._map
        self._orbits = []
        if period_map is None:
            return self._left(steady(integrator, motion, watch))
        near = None if doubt else self._orbit(period_map, motion, AT_ONCE)
        if near is not None:
            return self._kept(period_map, near)
        rough, settled, drift = settle(integrator, motion, watch, ROUGH)
        if settled:
            polished = self._orbit(period_map, rough, SAME_STATE * max(drift, MISS))
            if polished is not None:
                return self._kept(period_map, polished, float(rough.period - motion.period))
        return self._left(steady(integrator, rough if rough.is_finite else motion, watch))

    def _predicted(self) -> Array:
        """Return a guess for the next orbit by extrapolation through the last ones."""
        guess = np.zeros_like(self._orbits[-1].u)
        at = [float(orbit.u[-1]) for orbit in self._orbits]
        for a, orbit in zip(at, self._orbits, strict=True):
            guess += orbit.u * np.prod([(self._value - b) / (a - b) for b in at if b != a])
        guess[-1] = self._value
        return guess

    def _orbit(self, period_map: PeriodMap, motion: Motion, room: float) -> Orbit | None:
        """Return the stable orbit no farther than `room` from a motion."""
        found = orbit_from(period_map, motion, self._value)
        if found is None or not found.is_stable:
            return None
        return found if np.abs(found.u[:-1] - period_map.state(motion)).max() < room else None

    def _kept(self, period_map: PeriodMap, orbit: Orbit, periods: float = 0.0) -> Steady:
        known = [other for other in self._orbits if other.u[-1] != orbit.u[-1]]
        self._orbits = [*known, orbit][-(ORDER + 1) :]
        found = as_steady(period_map, orbit)
        return self._left(replace(found, values=dict(found.values) | {"settling_periods": periods}))

    def _left(self, found: Steady) -> Steady:
        self._motion = found.motion if found.motion.is_finite else None
        return found


def kick(before: Array, end: Array, orbit: Orbit) -> float:
    """Return how hard a state is kicked that the map takes from `before` to `end`, see :func:`dforce.solvers.kicks.kick`."""
    off = before - orbit.u[:-1]
    bent = end - orbit.u[:-1] - orbit.jacobian @ off
    largest = float(np.abs(off).max())
    if largest < SMALL:
        return 0.0
    if not largest <= LARGE:
        return np.inf
    return float(np.abs(np.linalg.solve(np.eye(len(off)) - orbit.jacobian, bent)).max()) / largest
