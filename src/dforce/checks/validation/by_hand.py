"""A periodic orbit of dForce, checked by DOP853 over force laws written by hand: nothing of dForce but its start."""

from __future__ import annotations

import math

import numpy as np

from dforce.checks.validation.tip_equation import Region, TipEquation, attraction_that_stops, dmt_with_drag, jkr
from dforce.core.arrays import Array
from dforce.forces import Force
from dforce.forces.dmt import DMT
from dforce.forces.hertz import Hertz
from dforce.forces.jkr import JKR
from dforce.forces.kelvin_voigt import KelvinVoigt
from dforce.forces.van_der_waals import VanDerWaals
from dforce.problem import Problem
from dforce.solvers.orbit import Orbit

ROUNDS = 2  # corrections: the first leaves the square of the orbit's error


def equation(problem: Problem, zc: float) -> TipEquation | None:
    """Return the tip equation of a problem with its law written by hand; None for forces that are not written here."""
    a0, kinds = problem.a0, {type(force): force for force in problem.forces}
    law = regions = None
    if set(kinds) <= {Hertz, DMT, KelvinVoigt}:
        elastic: Force = kinds[DMT] if DMT in kinds else kinds[Hertz]
        hamaker = elastic.H if isinstance(elastic, DMT) else 0.0
        viscosity = kinds[KelvinVoigt].viscosity if KelvinVoigt in kinds else 0.0  # type: ignore[attr-defined]
        law = dmt_with_drag(elastic.radius, elastic.E_eff, hamaker, viscosity, a0)  # type: ignore[attr-defined]
        regions = [Region(a0, a0)]
    elif set(kinds) == {VanDerWaals, Hertz}:
        contact = kinds[Hertz]
        law = attraction_that_stops(contact.radius, contact.E_eff, kinds[VanDerWaals].hamaker, a0)  # type: ignore[attr-defined]
        regions = [Region(a0, a0)]
    elif set(kinds) == {JKR}:
        sticky = kinds[JKR]
        law, region = jkr(sticky.surface_energy, sticky.radius, sticky.E_eff, a0)  # type: ignore[attr-defined]
        # a hair beside the other region's edge: of two events at one time the integrator would see one
        edge = a0 * (1.0 - 1e-9)
        regions = [region, Region(edge, edge)]
    if law is None or regions is None or problem.shaken is not None:
        return None
    drives = [
        (tone.frequency, row.tolist(), tone.phase) for tone, row in zip(problem.tones, problem.drive, strict=True)
    ]
    modes = [(mode.f0, mode.k, mode.Q) for mode in problem.modes]
    return TipEquation(modes, drives, zc, law, regions, length=problem.tones[0].A0)


def measured(problem: Problem, zc: float, orbit: Orbit, common: int) -> dict[str, float] | None:
    """Return the measurements of DOP853 on its own periodic orbit next to an orbit found; None without a law by hand.

    The map's derivatives at the orbit found correct it, until the hand-written equation repeats.
    """
    ready = equation(problem, zc)
    if ready is None or np.any(orbit.kept.branch):
        return None
    modes, seconds = len(problem.modes), common / problem.tones[0].frequency
    size = np.tile([ready.length, 2.0 * math.pi * problem.tones[0].frequency * ready.length], modes)
    x: Array = orbit.x[: 2 * modes].copy()
    for _ in range(ROUNDS):
        state = x * size
        z, v, _memory = ready.follow(state[::2], state[1::2], seconds)
        miss = np.column_stack([z, v]).ravel() / size - x
        x = x + np.linalg.solve(np.eye(2 * modes) - orbit.monodromy[: 2 * modes, : 2 * modes], miss)
    state = x * size
    return ready.measure(state[::2], state[1::2], seconds)
