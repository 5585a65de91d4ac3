"""One force over a prescribed motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, cast

import numpy as np

from dforce.core.arrays import Array
from dforce.core.errors import ForceError, ParameterError
from dforce.core.units import show
from dforce.forces import Force, check_answers, guarded
from dforce.kernel.linker import compile_function

Motion = Callable[[float], tuple[float, float]]


@dataclass(frozen=True)
class Answer:
    """The result of :func:`follow` at each time (s): distance (m), force (N), energy taken (J), latch."""

    time: Array
    distance: Array
    force: Array
    energy: Array
    latched: Array


def follow(
    force: Force,
    motion: Motion,
    times: Sequence[float],
    compiled: bool = False,
    tolerance: float | None = None,
    zc: float | None = None,
) -> Answer:
    """Return one force over a prescribed motion that starts on a rested sample.

    Energy is integrated by Simpson's rule between neighboring times, memory by two fourth-order Runge–Kutta
    steps; a latch switches where its function becomes positive, found by bisection. Where a law has no
    finite value, the force is NaN.

    Parameters
    ----------
    force
        A bound force.
    motion
        Distance (m) and rate of change (m/s) at a time (s).
    times
        Increasing times (s); the step is their spacing.
    compiled
        Run the law through numba: worth it for a long motion of a force with many states.
    tolerance
        Integrate memory by LSODA with this relative tolerance instead: for times that are far apart against
        the relaxation.
    zc
        Average distance (m), for a law of the deflection.

    Raises
    ------
    ParameterError
        When the law depends on the deflection and `zc` is not given.
    ForceError
        When a function of the force fails or returns no number.
    """
    if "zc" in force.leading() and zc is None:
        raise ParameterError(f"{force.name} depends on the deflection z, which needs an average distance: pass zc")
    check_answers(force)  # compiled code reports no mistakes
    wrap = compile_function if compiled else (lambda function: function)
    evolve = wrap(force.evolve) if force.evolve is not None else None
    run = _PathState(
        motion,
        guarded(force.name, wrap(force.law_function())),
        evolve,
        guarded(force.name, wrap(force.switch), "switch") if force.switch is not None else None,
        force.values(),
        (zc,) if zc is not None and "zc" in force.leading() else (),
        np.zeros(force.memory),
        _memory_path(force, evolve, motion, times, tolerance) if tolerance and evolve is not None else None,
    )
    rows = []
    for start, stop in pairwise((times[0], *times)):
        run.advance(start, stop)
        distance, _, value = run.point(stop)
        rows.append((stop, distance, value, run.energy, run.latched))
    return Answer(*(np.array(column) for column in zip(*rows, strict=True)))


def forces_at(force: Force, distance: Array, velocity: Array, zc: float | None = None) -> Array:
    """Return a force without memory at distances (m) and velocities (m/s) of one shape; NaN where it has no finite value."""
    law, values = force.plain_law(), force.values()
    place = (zc,) if "zc" in force.leading() else ()
    pairs = zip(distance.ravel().tolist(), velocity.ravel().tolist(), strict=True)
    each = (law(d, rate, 0.0, *place, *values) for d, rate in pairs)
    return np.fromiter(each, float, distance.size).reshape(distance.shape)


@dataclass
class _PathState:
    motion: Motion
    law: Callable[..., float]
    evolve: Callable[..., None] | None
    switch: Callable[..., float] | None
    arguments: tuple[Any, ...]
    place: tuple[float, ...]
    memory: Array
    path: Callable[[float], Array] | None
    latched: float = 0.0
    energy: float = 0.0
    last: tuple[float, float, tuple[float, float, float]] | None = None  # time, latch, and the point there

    def point(self, t: float) -> tuple[float, float, float]:
        """Return distance, its rate, and force at a time; a step begins where the last one ended, so that is kept."""
        if self.last is not None and self.last[0] == t and self.last[1] == self.latched:
            return self.last[2]
        memory = (self.memory,) if self.evolve is not None else ()
        latched = (self.latched,) if self.switch is not None else ()
        distance, rate = self.motion(t)
        force = self.law(distance, rate, t, *memory, *latched, *self.place, *self.arguments)
        found = distance, rate, force
        if self.evolve is None:  # else the memory moves on meanwhile
            self.last = t, self.latched, found
        return found

    def advance(self, start: float, stop: float) -> None:
        for _ in range(8):  # a latch that switches more often within one step has no branch to rest on
            if self._wants_to_switch(start):
                self.latched = 1.0 - self.latched
                continue
            if not self._wants_to_switch(stop):
                break
            low, high = start, stop
            while high - low > 1e-15 * (abs(high) + abs(stop - start)):
                middle = 0.5 * (low + high)
                if middle in (low, high):
                    break
                low, high = (low, middle) if self._wants_to_switch(middle) else (middle, high)
            self._move(start, high)
            self.latched, start = 1.0 - self.latched, high
        self._move(start, stop)

    def _wants_to_switch(self, t: float) -> bool:
        return self.switch is not None and self.switch(self.latched, *self.motion(t), t, *self.arguments) > 0.0

    def _power(self, t: float) -> float:
        _, rate, force = self.point(t)
        return -force * rate

    def _move(self, start: float, stop: float) -> None:
        middle, step = 0.5 * (start + stop), stop - start
        if step <= 0.0:
            return
        power = self._power(start)
        self._evolve(start, 0.5 * step)
        power += 4.0 * self._power(middle)
        self._evolve(middle, 0.5 * step)
        self.energy += step / 6.0 * (power + self._power(stop))

    def _evolve(self, t: float, step: float) -> None:
        if self.path is not None:
            self.memory = self.path(t + step)
        if self.evolve is None or self.path is not None:
            return
        slopes: list[Array] = []
        for fraction in (0.0, 0.5, 0.5, 1.0):
            state = self.memory + (fraction * step * slopes[-1] if slopes else 0.0)
            change = np.zeros_like(self.memory)
            self.evolve(*self.motion(t + fraction * step), t + fraction * step, state, change, *self.arguments)
            slopes.append(change)
        self.memory = self.memory + step / 6.0 * (slopes[0] + 2.0 * (slopes[1] + slopes[2]) + slopes[3])


def _memory_path(
    force: Force, evolve: Callable[..., None], motion: Motion, times: Sequence[float], tolerance: float
) -> Callable[[float], Array]:
    """Return the memory as a function of time; it depends on the motion alone, not on a latch."""
    from scipy.integrate import solve_ivp

    arguments = force.values()

    def rates(t: float, memory: Array) -> Array:
        change = np.zeros_like(memory)
        d, rate = motion(t)
        evolve(d, rate, t, memory, change, *arguments)
        if not np.isfinite(change).all():  # LSODA would not end
            raise ForceError(f"the evolve of '{force.name}' at d = {show(d, 'm', 3)} gives no finite number")
        return change

    below, above = _bandwidths(rates, force, (times[0], times[len(times) // 4], times[len(times) // 2]))
    solved = solve_ivp(
        rates,
        (times[0], times[-1]),
        np.zeros(force.memory),
        "LSODA",
        dense_output=True,
        rtol=tolerance,
        atol=tolerance * force.memory_scale,
        lband=below,
        uband=above,
        max_step=(times[-1] - times[0]) / 200.0,  # a short contact must not be stepped over
    )
    if not solved.success:
        raise ParameterError(f"the memory of {force.name} cannot be integrated over this motion")
    return cast("Callable[[float], Array]", solved.sol)


def _bandwidths(rates: Callable[[float, Array], Array], force: Force, times: Sequence[float]) -> tuple[int, int]:
    """Return how far below and above the diagonal a state acts on others' rates.

    A viscoelastic contact has hundreds of states, and only neighbors act on each other: with the bandwidths an implicit
    integrator is a hundred times as fast. An overlooked coupling costs steps, not accuracy.
    """
    rng = np.random.default_rng(1)  # any state will do; a fixed one gives the same answer every time
    below = above = 0
    for t in times:
        memory = force.memory_scale * rng.random(force.memory)
        base = rates(t, memory)
        for j in range(force.memory):
            moved = memory.copy()
            moved[j] += force.memory_scale
            touched = np.flatnonzero(rates(t, moved) != base)
            if len(touched):
                below, above = max(below, int(touched[-1]) - j), max(above, j - int(touched[0]))
    return below, above
