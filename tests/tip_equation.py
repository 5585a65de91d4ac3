"""The tip equation written a second time, from its formulas, for SciPy's DOP853; it uses nothing of dForce.

    m z'' + (m w0 / Q) z' + k z = sum_j F_j cos(w_j t + theta_j) + F(d, d')    for each mode,    d = zc + sum z

Regions of the force with an edge (contact, a neck) are followed as flags that flip at events, so that DOP853 only ever
sees smooth functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp


@dataclass(frozen=True)
class Region:
    """A flag that is set when the tip comes nearer than `enter` and cleared when it goes farther than `leave`."""

    enter: float
    leave: float


@dataclass
class TipEquation:
    """A cantilever over a force, in SI units.

    `force(d, v, flags, memory)` returns newtons; `flow(d, v, flags, memory)` the rates of the memory.
    """

    modes: Sequence[tuple[float, float, float]]  # f0, k, Q
    drives: Sequence[tuple[float, Sequence[float], float]]  # frequency, force on each mode, phase
    zc: float
    force: Callable[..., float]
    regions: Sequence[Region] = ()
    memory: int = 0
    flow: Callable[..., Sequence[float]] | None = None
    memory_size: float = 1.0
    length: float = 1e-8
    flips: list[float] = field(default_factory=list)

    def free(self, t: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Return deflections and velocities of each mode in the steady motion without force."""
        z, v = np.zeros(len(self.modes)), np.zeros(len(self.modes))
        for frequency, forces, phase in self.drives:
            w = 2 * math.pi * frequency
            for n, (f0, k, Q) in enumerate(self.modes):
                w0 = 2 * math.pi * f0
                x = forces[n] / (k / w0**2) / complex(w0**2 - w**2, w * w0 / Q)
                turn = x * np.exp(1j * (w * t + phase))
                z[n] += turn.real
                v[n] += (1j * w * turn).real
        return z, v

    def follow(self, z: np.ndarray, v: np.ndarray, seconds: float, rtol: float = 1e-12) -> tuple[np.ndarray, ...]:
        """Return deflections, velocities and memory after a time, from a rested sample."""
        count, speed = len(self.modes), self.length * 2 * math.pi * self.modes[0][0]
        scale = np.array([self.length] * count + [speed] * count + [self.memory_size] * self.memory)
        rest = [(2 * math.pi * f0, k, Q) for f0, k, Q in self.modes]
        drives = [(2 * math.pi * frequency, forces, phase) for frequency, forces, phase in self.drives]

        def slopes(t, y):
            y = y * scale
            z, v, memory = y[:count], y[count : 2 * count], y[2 * count :]
            d, rate = self.zc + float(z.sum()), float(v.sum())
            f = self.force(d, rate, flags, memory)
            a = []
            for n, (w0, k, Q) in enumerate(rest):
                push = f + sum(forces[n] * math.cos(w * t + phase) for w, forces, phase in drives)
                a.append(push * w0 * w0 / k - w0 * v[n] / Q - w0 * w0 * z[n])
            change = self.flow(d, rate, flags, memory) if self.flow else []
            return np.array([*v, *a, *change]) / scale

        y, t = np.array([*z, *v, *[0.0] * self.memory]) / scale, 0.0
        d = self.zc + float(np.sum(z))
        flags = [d < region.enter for region in self.regions]
        while t < seconds:
            events = []
            for i, region in enumerate(self.regions):
                edge = region.leave if flags[i] else region.enter

                def cross(t, y, edge=edge):
                    return (self.zc + float(y[:count].sum()) * self.length - edge) / self.length

                cross.terminal, cross.direction = True, 1 if flags[i] else -1
                events.append(cross)
            found = solve_ivp(
                slopes, (t, seconds), y, method="DOP853", rtol=rtol, atol=1e-3 * rtol, events=events,
                max_step=1 / self.modes[0][0] / 60,
            )  # fmt: skip
            assert found.success, found.message
            t, y = float(found.t[-1]), found.y[:, -1]
            for i, times in enumerate(found.t_events or []):
                if len(times):
                    flags[i] = not flags[i]
                    self.flips.append(t)
        y = y * scale
        return y[:count], y[count : 2 * count], y[2 * count :]


def hertz(radius: float, E_eff: float, depth: float) -> float:
    return 4.0 / 3.0 * E_eff * math.sqrt(radius) * max(depth, 0.0) ** 1.5


def dmt_with_drag(radius: float, E_eff: float, hamaker: float, viscosity: float, a0: float) -> Callable[..., float]:
    """Return DMT contact with Kelvin–Voigt drag; one region, the contact."""

    def force(d, v, flags, memory):
        if not flags[0]:
            return -hamaker * radius / (6 * d * d)
        depth = max(a0 - d, 0.0)
        adhesion = hamaker * radius / (6 * a0 * a0)
        return hertz(radius, E_eff, depth) - adhesion - viscosity * math.sqrt(radius * depth) * v

    return force


def attraction_that_stops(radius: float, E_eff: float, hamaker: float, a0: float) -> Callable[..., float]:
    """Return the paper's law that jumps: van der Waals outside contact, Hertz alone inside."""

    def force(d, v, flags, memory):
        return hertz(radius, E_eff, a0 - d) if flags[0] else -hamaker * radius / (6 * d * d)

    return force
