"""The tip equation written a second time, from its formulas, for SciPy's DOP853; it uses nothing of dForce.

    m z'' + (m w0 / Q) z' + k z = Re sum_j F_j e^(i (w_j t + theta_j)) + F(d, d')    for each mode,    d = zc + sum z

Regions of the force with an edge (contact, a neck) are flags that flip at events, so that DOP853 only integrates smooth
functions. The observables are integrals, solved along with the motion.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

from dforce.core.arrays import Array

STEPS = 60  # a period of the first mode, at least: a contact must not be stepped over
MEASURED = 6  # integrals: z cos, z sin, F, F v, F z, and z
LOOKS = 40  # a step of the integrator, to find where a force is largest


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
    drives: Sequence[tuple[float, Sequence[complex], float]]  # frequency, force on each mode, phase
    zc: float
    force: Callable[..., float]
    regions: Sequence[Region] = ()
    memory: int = 0
    flow: Callable[..., Sequence[float]] | None = None
    memory_size: float = 1.0
    length: float = 1e-8
    flips: list[float] = field(default_factory=list)

    def free(self, t: float = 0.0) -> tuple[Array, Array]:
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

    def follow(self, z: Array, v: Array, seconds: float, rtol: float = 1e-12) -> tuple[Array, Array, Array]:
        """Return deflections, velocities and memory after a time, from a rested sample."""
        y, count = self._solve(z, v, seconds, rtol, lambda t, y, flags: None), len(self.modes)
        return y[:count], y[count : 2 * count], y[2 * count : 2 * count + self.memory]

    def measure(self, z: Array, v: Array, seconds: float, rtol: float = 1e-12) -> dict[str, float]:
        """Return the observables of a motion that repeats after `seconds`, by the names of a result (tone 1 alone).

        The last region is the contact.
        """
        forces: list[float] = []
        distances: list[float] = []
        inside: list[float] = []

        def look(times: Array, states: Callable[[Array], Array], flags: Sequence[bool]) -> None:
            count, last = len(self.modes), times[0]
            for t in times[1:]:
                grid = np.linspace(last, t, LOOKS)
                y = states(grid)
                d = self.zc + self.length * y[:count].sum(axis=0)
                speeds = self._speed() * y[count : 2 * count].sum(axis=0)
                f = np.array([self.force(*pair, flags, ()) for pair in zip(d, speeds, strict=True)])
                forces.extend((_top(f), -_top(-f)))
                distances.append(-_top(-d))
                last = t
            if flags and flags[-1]:
                inside.append(float(times[-1] - times[0]))

        y, count = self._solve(z, v, seconds, rtol, look), len(self.modes)
        cos, sin, force, power, work, mean = y[2 * count + self.memory :] / seconds
        c = 2.0 * complex(cos, -sin)
        phase = math.degrees(math.atan2(-c.imag, c.real)) + math.degrees(self.drives[0][2])
        return {
            "amplitude": abs(c) * self.length,
            "phase": phase,
            "mean_deflection": mean * self.length,
            "mean_force": force,
            "total_virial": work - force * mean * self.length,
            "total_dissipated_energy": -power / self.drives[0][0],
            "peak_force": max(forces),
            "min_force": min(forces),
            "min_distance": min(distances),
            "contact_fraction": sum(inside) / seconds,
        }

    def _speed(self) -> float:
        return self.length * 2 * math.pi * self.modes[0][0]

    def _solve(self, z: Array, v: Array, seconds: float, rtol: float, look: Callable[..., None]) -> Array:
        """Return the motion after a time, its memory, and the integrals; `look` sees each smooth stretch on the way."""
        count, speed = len(self.modes), self._speed()
        scale = np.array([self.length] * count + [speed] * count + [self.memory_size] * self.memory)
        rest = [(2 * math.pi * f0, k, Q) for f0, k, Q in self.modes]
        drives = [(2 * math.pi * frequency, forces, phase) for frequency, forces, phase in self.drives]

        def slopes(t: float, y: Array) -> Array:
            x = y[: len(scale)] * scale
            z, v, memory = x[:count], x[count : 2 * count], x[2 * count :]
            tip, rate = float(z.sum()), float(v.sum())
            d = self.zc + tip
            f = self.force(d, rate, flags, memory)
            a = []
            for n, (w0, k, Q) in enumerate(rest):
                push = f + sum((forces[n] * cmath.exp(1j * (w * t + phase))).real for w, forces, phase in drives)
                a.append(push * w0 * w0 / k - w0 * v[n] / Q - w0 * w0 * z[n])
            change = self.flow(d, rate, flags, memory) if self.flow else []
            turn, share = drives[0][0] * t, tip / self.length
            integrals = [share * math.cos(turn), share * math.sin(turn), f, f * rate, f * tip, share]
            return np.array([*(np.array([*v, *a, *change]) / scale), *integrals])

        y, t = np.concatenate([np.array([*z, *v, *[0.0] * self.memory]) / scale, np.zeros(MEASURED)]), 0.0
        flags = [self.zc + float(np.sum(z)) < region.enter for region in self.regions]
        # the integrals' sizes: 1 for lengths by their scaling; k A0/Q and its work for forces
        push = max(abs(f) for _, forces, _ in self.drives for f in forces)
        sizes = np.array([1.0, 1.0, push, push * speed, push * self.length, 1.0]) / self.modes[0][0]
        tolerance = 1e-3 * rtol * np.concatenate([np.ones(len(scale)), sizes])
        while t < seconds:
            events: list[Callable[[float, Array], float]] = []
            for i, region in enumerate(self.regions):

                def cross(t: float, y: Array, edge: float = region.leave if flags[i] else region.enter) -> float:
                    return (self.zc + float(y[:count].sum()) * self.length - edge) / self.length

                cross.terminal, cross.direction = True, 1 if flags[i] else -1  # type: ignore[attr-defined]
                events.append(cross)
            found = solve_ivp(
                slopes,
                (t, seconds),
                y,
                method="DOP853",
                rtol=rtol,
                atol=tolerance,
                events=events,
                dense_output=True,
                max_step=1 / self.modes[0][0] / STEPS,
            )
            if not found.success:
                raise ArithmeticError(found.message)
            look(found.t, found.sol, flags)
            t, y = float(found.t[-1]), found.y[:, -1]
            for i, times in enumerate(found.t_events or []):
                if len(times):
                    flags[i] = not flags[i]
                    self.flips.append(t)
        return np.concatenate([y[: len(scale)] * scale, y[len(scale) :]])


def _top(values: Array) -> float:
    """Return the maximum of the parabola through the largest of evenly spaced values and its neighbors."""
    i = int(np.argmax(values))
    if not 0 < i < len(values) - 1:
        return float(values[i])
    low, middle, high = values[i - 1 : i + 2]
    bend = low - 2.0 * middle + high
    return float(middle - (high - low) ** 2 / (8.0 * bend)) if bend < 0.0 else float(middle)


def hertz(radius: float, E_eff: float, depth: float) -> float:
    """Return Hertz' force (N)."""
    return float(4.0 / 3.0 * E_eff * math.sqrt(radius) * max(depth, 0.0) ** 1.5)


def dmt_with_drag(radius: float, E_eff: float, hamaker: float, viscosity: float, a0: float) -> Callable[..., float]:
    """Return DMT contact with Kelvin–Voigt drag; one region, the contact."""

    def force(d: float, v: float, flags: Sequence[bool], memory: object) -> float:
        if not flags[0]:
            return -hamaker * radius / (6 * d * d)
        depth = max(a0 - d, 0.0)
        adhesion = hamaker * radius / (6 * a0 * a0)
        return hertz(radius, E_eff, depth) - adhesion - viscosity * math.sqrt(radius * depth) * v

    return force


def attraction_that_stops(radius: float, E_eff: float, hamaker: float, a0: float) -> Callable[..., float]:
    """Return the paper's law that jumps: van der Waals outside contact, Hertz alone inside."""

    def force(d: float, v: float, flags: Sequence[bool], memory: object) -> float:
        return hertz(radius, E_eff, a0 - d) if flags[0] else -hamaker * radius / (6 * d * d)

    return force


def jkr(gamma: float, radius: float, E_eff: float, a0: float) -> tuple[Callable[..., float], Region]:
    """Return the JKR law and its region: in at zero depth, off where the branch at a prescribed distance ends."""
    from scipy.optimize import brentq

    unit = (3 * math.pi**2 * gamma**2 * radius / (16 * E_eff**2)) ** (1 / 3)
    last = 3.0 ** (-1 / 3)

    def force(d: float, v: float, flags: Sequence[bool], memory: object) -> float:
        if not flags[0]:
            return 0.0
        depth = max((a0 - d) / unit, 3 * last**4 - 4 * last)
        q = brentq(lambda q: 3 * q**4 - 4 * q - depth, last, 2 + abs(depth), xtol=1e-15, rtol=1e-15)
        return float(3 * math.pi * gamma * radius * (q**6 - 2 * q**3))

    return force, Region(a0, a0 + 3 ** (2 / 3) * unit)
