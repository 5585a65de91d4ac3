"""Recipes for the values in the tables that concern motions: transients, steady states, averages."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from dforce.case import Case, example
from dforce.experiments import InitialMotion
from dforce.forces.dmt import DMT
from dforce.forces.hertz import Hertz
from dforce.forces.kelvin_voigt import KelvinVoigt
from dforce.forces.sneddon import Sneddon
from dforce.instrument import Cantilever, Drive, Sample, Tip
from dforce.observables.finish import finish
from dforce.problem import Instrument, Problem
from dforce.results.status import whole
from dforce.runs import dwell
from dforce.solvers import SolverSettings
from dforce.solvers.integrator import INTEGRATORS

Given = Mapping[str, Any]
# for comparisons to ten digits: orbits may miss their start by 1e-9 of A0, and their amplitudes err by Q times as much
SETTLED = SolverSettings(method="transient", integrator="engine", relative_tolerance=1e-12, settle_tolerance=1e-11)
ORBIT = SolverSettings(points_per_period=2048)  # for multipliers, which only an orbit has
FAR = 1e-6  # m; nothing reaches so far
# spring constant (N/m) and Q of a lever that swings as A cos wt: forces and drive are 1e-8 of the force in its spring at most
UNMOVED, UNDAMPED = 1e8, 1e8


@lru_cache(maxsize=16)
def _resonant(contact: str) -> Case:
    """Return the lever of the values known in closed form: 50 kHz, 1 N/m, Q = 100, A0 = 10 nm."""
    # a flat punch of 2 nm that is always in contact is a spring of 2 E_eff R = 0.05 N/m
    forces = [Sneddon(geometry="punch")] if contact == "punch" else [Hertz()]
    return Case(
        cantilever=Cantilever(f0=50e3, k=1.0, Q=100.0),
        drive=Drive(A0=10e-9),
        tip=Tip(radius=2e-9, half_angle="20 deg"),
        sample=Sample(youngs_modulus=0.05 / (2.0 * 2e-9) * (1.0 - 0.3**2), poisson_ratio=0.3),
        forces=forces,
    )


@lru_cache(maxsize=1)
def _from_rest() -> Any:
    solver = SolverSettings(method="transient", integrator="engine", settle="fixed", periods=52)
    return whole(dwell(_resonant("hertz").replace(solver=solver), FAR, start="rest", record="all", recorded_periods=8))


def from_rest(given: Given) -> float:
    """Return the deflection (m) so many periods after a start from rest, or the driving force (N)."""
    if given.get("give") == "force":
        return float(_resonant("hertz").problem.tones[0].force)
    trace = _from_rest()
    return float(trace.deflection.values[round(given["turns"] * trace.attrs["samples_per_period"])])


def linear_force(given: Given) -> float:
    """Return an observable of the orbit in a contact that is a spring, pressed 20 nm in."""
    case = _resonant("punch").replace(solver=SETTLED)
    return float(np.ravel(whole(dwell(case, 0.165e-9 - 20e-9))[given["give"]])[0])


@lru_cache(maxsize=16)
def _steady(name: str, zc: float, start: tuple[float, float] | None, solver: SolverSettings) -> Any:
    motion: Any = "free" if start is None else InitialMotion(amplitude=start[0], phase=math.radians(start[1]))
    return whole(dwell(example(name).replace(solver=solver), zc, start=motion, recorded_periods=1))


def steady(given: Given) -> float:
    """Return an observable of the steady motion of a shipped example at a distance."""
    start, name = (tuple(given["start"]) if "start" in given else None), given["give"]
    solver = ORBIT if name.startswith("multiplier") else SETTLED
    found = _steady(given["example"], given["zc"], start, solver)
    if name == "multiplier_product":
        return float(np.prod(found.multiplier_modulus.values))
    return float(np.ravel(found[name])[0])


@lru_cache(maxsize=1)
def _bimodal() -> Any:
    return whole(dwell(example("table-1-bimodal"), recorded_periods=1))


def bimodal(given: Given) -> float:
    """Return an observable of table 1's bimodal motion."""
    return float(np.ravel(_bimodal()[given["give"]])[given.get("place", 0)])


def averages(
    zc: float,
    amplitude: float,
    hamaker: float = 0.0,
    viscosity: float = 0.0,
    frequency: float = 50e3,
    points: int = 512,
) -> dict[str, Any]:
    """Return the observables of d = zc + A cos ωt above DMT and Kelvin–Voigt (R = 2 nm, 1 GPa, ν = 0.3).

    The measurement takes accelerations from the tip equation. So the motion obeys it: the free motion of a lever too stiff
    for the force and too little damped to need a drive.
    """
    problem = Problem.build(
        Instrument(
            Cantilever(f0=frequency, k=UNMOVED, Q=UNDAMPED),
            Drive(A0=10e-9),
            Tip(radius=2e-9),
            Sample(youngs_modulus=1e9, poisson_ratio=0.3),
        ),
        forces=[DMT(hamaker=hamaker), KelvinVoigt(viscosity=viscosity)],
    )
    settings = SolverSettings(method="transient", integrator="engine", points_per_period=points)
    ready = INTEGRATORS[settings.integrator](problem, settings, 5)
    ready.place(zc)
    turn = 2.0 * np.pi * np.arange(points + 1) / points
    ready.samples[:, 0] = amplitude / ready.scales.length * np.cos(turn)
    ready.samples[:, 1] = -amplitude / ready.scales.length * np.sin(turn)
    for i in range(points + 1):
        d, v = zc + amplitude * math.cos(turn[i]), ready.samples[i, 1] * ready.scales.speed
        ready.samples[i, -1] = sum(f.law_function()(d, v, 0.0, *f.values()) for f in problem.forces)
    row = np.empty((1, ready.columns))
    ready.measure(0, row[0])
    return finish(problem, 5, row, np.ones(1))


def average(given: Given) -> float:
    """Return an average over a prescribed motion."""
    return float(averages(given["zc"], given["amplitude"], given["hamaker"])[given["give"]])


MOTION_RECIPES: dict[str, Callable[[Given], float]] = {
    "from_rest": from_rest,
    "linear_force": linear_force,
    "steady": steady,
    "bimodal": bimodal,
    "average": average,
}
