"""A steady motion found twice: by the usual solver, and as the engine's periodic orbit.

The reference shares only the start. It takes steps of order 8 with error control that end on every kink, in the frame of the
free lever. Newton's method solves for the orbit on the map of a period.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce.case import Case
from dforce.core.arrays import Array
from dforce.experiments.base import Start, initial_motion
from dforce.observables.averaging import weights, window_length
from dforce.problem import Problem
from dforce.solvers import SolverSettings
from dforce.solvers.block import Block
from dforce.solvers.integrator import Integrator, Motion
from dforce.solvers.orbit import Orbit
from dforce.solvers.parameter_range import ParameterRange
from dforce.solvers.protocols import settle_at
from dforce.solvers.states import States

HARMONICS = 10
TOLERANCE = 1e-11  # of the reference, a step
SETTLED = 1e-9  # where Newton's method finds no orbit, as with a memory that lasts, the motion is left to settle so far
SEEN = 0.01  # of the free amplitude: the phase of a smaller motion is not compared


@dataclass(frozen=True)
class SteadyMotion:
    """A steady motion of the usual solver.

    Attributes
    ----------
    values
        Its observables.
    motion
        The state at the start of a common period.
    by_newton
        Whether it was found as a periodic orbit; otherwise it settled.
    integrator
        Its integrator.
    """

    values: Mapping[str, Any]
    motion: Motion
    by_newton: bool
    integrator: Integrator

    def mean_squares(self) -> Array:
        """Return the mean squared velocity of each mode (m²/s²)."""
        return mean_squares(self.integrator, self.motion)


def mean_squares(integrator: Integrator, motion: Motion) -> Array:
    """Return the mean squared velocity of each mode (m²/s²) over the window in which a motion repeats or beats."""
    frequencies = [tone.frequency for tone in integrator.problem.tones]
    count, squares = window_length(frequencies), []
    for _ in range(count):
        motion, block = integrator.record(motion)
        v = block[:-1, 1 : 2 * len(integrator.problem.modes) : 2] * integrator.scales.speed
        squares.append((v**2).mean(axis=0))
    return np.asarray(weights(frequencies, count) @ np.array(squares))


def find(case: Case, zc: float, points: int, start: Start | Motion = "free") -> SteadyMotion | None:
    """Return the steady motion that another one settles to; None where none repeats with the tones."""
    for settings in (
        SolverSettings(points_per_period=points),
        SolverSettings(method="transient", points_per_period=points, settle_tolerance=SETTLED),
    ):
        block = Block.of_one(case.problem, settings, HARMONICS, lambda: None)
        integrator = block.integrator(0, zc)
        found = settle_at(block, start if isinstance(start, Motion) else initial_motion(integrator, start), zc)
        by_newton = "multiplier_modulus" in found.values
        if by_newton or settings.method == "transient":
            break
        if not (found.settled and found.repeats):
            return None
    if not (found.settled and found.repeats):
        return None
    common = window_length([tone.frequency for tone in case.problem.tones])
    motion, _ = integrator.lock_in(found.motion, -found.motion.period % common)
    return SteadyMotion(found.values, motion, by_newton, integrator)


@dataclass(frozen=True)
class Reference:
    """A periodic orbit and its observables in SI units by name."""

    orbit: Orbit
    values: Mapping[str, Any]


def reference(problem: Problem, zc: float, near: Motion) -> Reference | None:
    """Return the engine's periodic orbit next to a motion; None where Newton's method finds none."""
    settings = SolverSettings(method="transient", integrator="engine", relative_tolerance=TOLERANCE)
    among, state = ParameterRange(lambda _: problem, 0.0, zc, settings, HARMONICS), States.of(near)
    orbit = among.find(np.append(among.vectors(state), among.high), state.branch)
    return None if orbit is None else Reference(orbit, among.steady(orbit).values)


SIZES = {
    "orbit": "A0 of its tone",
    "amplitude": "A0 of its tone",
    "phase": "degrees, where A is above 0.01 A0",
    "harmonic_amplitude": "A0",
    "mean_deflection": "A0",
    "half_peak_to_peak": "A0",
    "max_indentation": "A0",
    "contact_fraction": "the period",
    "peak_velocity": "ωA0",
    "peak_force": "the largest force",
    "min_force": "the largest force",
    "total_virial": "π F0 A0",
    "total_dissipated_energy": "π F0 A0",
}
"""The scale of each disagreement; ``orbit`` scales the complex amplitudes."""


def disagreement(problem: Problem, found: Mapping[str, Any], exact: Mapping[str, Any]) -> dict[str, float]:
    """Return how far two sets of observables are apart, each relative to its size of :data:`SIZES`."""
    tone = problem.tones[0]
    free = np.array([tone.A0 for tone in problem.tones])
    energy, speed = np.pi * tone.force * tone.A0, 2.0 * np.pi * tone.frequency * tone.A0
    force = max(abs(exact["peak_force"]), abs(exact["min_force"]), tone.force)
    sizes = {
        "amplitude": free,
        "mean_deflection": tone.A0,
        "half_peak_to_peak": tone.A0,
        "max_indentation": tone.A0,
        "harmonic_amplitude": tone.A0,
        "contact_fraction": 1.0,
        "peak_velocity": speed,
        "peak_force": force,
        "min_force": force,
        "total_virial": energy,
        "total_dissipated_energy": energy,
    }
    out = {
        name: float(np.max(np.abs(np.asarray(found[name]) - exact[name])[: np.size(exact[name])] / size))
        if np.ndim(exact[name])
        else abs(float(np.ravel(found[name])[0]) - float(exact[name])) / float(np.ravel(size)[0])
        for name, size in sizes.items()
        if name in exact
    }
    count = np.size(exact["amplitude"])
    a, b = (
        np.ravel(x["amplitude"])[:count] * np.exp(-1j * np.radians(np.ravel(x["phase"])[:count]))
        for x in (found, exact)
    )
    turned = np.degrees(np.abs(np.angle(a * b.conj())))
    out["orbit"] = float(np.max(np.abs(a - b) / free[:count]))
    out["phase"] = float(np.max(turned[np.abs(b) > SEEN * free[:count]], initial=0.0))
    return out
