"""How simulators of this kind integrate with right-hand sides in Python: SciPy's LSODA, and RK4."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from dforce.problem import Problem

Rates = Callable[[float, Any], list[float]]


def python_rates(problem: Problem, zc: float) -> Rates:
    """Return dy/dtau of a problem whose only force is a Hertz contact, driven without lag, as plain Python in scaled units."""
    first = problem.tones[0]
    length = first.A0
    stiffness, a0 = problem.forces[0].numbers()
    modes = [
        ((mode.f0 / first.frequency) ** 2, mode.f0 / first.frequency / mode.Q, 1.0 / (mode.k * length))
        for mode in problem.modes
    ]
    tones = [(tone.frequency / first.frequency, problem.drive[j].real) for j, tone in enumerate(problem.tones)]

    def rates(tau: float, y: Any) -> list[float]:
        depth = a0 - zc - length * sum(y[0::2])
        force = stiffness * depth * math.sqrt(depth) if depth > 0.0 else 0.0
        out = []
        for n, (square, damping, gain) in enumerate(modes):
            push = force + sum(drive[n] * math.cos(ratio * tau) for ratio, drive in tones)
            out += [y[2 * n + 1], square * (gain * push - y[2 * n]) - damping * y[2 * n + 1]]
        return out

    return rates


def lsoda(rates: Any, size: int, points: int, periods: int, arguments: tuple[Any, ...] = ()) -> Any:
    """Integrate by SciPy's LSODA from rest, read at every point; return the deflection of the first mode."""
    from scipy.integrate import ode

    solver = ode(rates).set_integrator("lsoda", rtol=1e-8, atol=1e-9, nsteps=10_000)
    solver.set_f_params(*arguments)
    solver.set_initial_value(np.zeros(size), 0.0)
    z = np.empty(points * periods)
    for i in range(z.size):
        z[i] = solver.integrate((i + 1) * 2.0 * math.pi / points)[0]
    return z


def rk4(rates: Rates, size: int, points: int, periods: int) -> Any:
    """Integrate by RK4 in plain Python from rest; return the deflection of the first mode."""
    h = 2.0 * math.pi / points
    y, z = np.zeros(size), np.empty(points * periods)
    for i in range(z.size):
        tau = i * h
        k1 = np.array(rates(tau, y))
        k2 = np.array(rates(tau + 0.5 * h, y + 0.5 * h * k1))
        k3 = np.array(rates(tau + 0.5 * h, y + 0.5 * h * k2))
        k4 = np.array(rates(tau + h, y + h * k3))
        y = y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        z[i] = y[0]
    return z
