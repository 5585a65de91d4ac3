"""The order of each integrator, measured: errors after four periods against the engine at its tightest.

Errors are root mean squares over distances, since where a kink falls within a step is a matter of chance.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from dforce.checks.validation.checks import Check, ValidationPart
from dforce.core.arrays import Array
from dforce.forces import Force
from dforce.forces.dmt import DMT
from dforce.forces.hertz import Hertz
from dforce.forces.kelvin_voigt import KelvinVoigt
from dforce.forces.sneddon import Sneddon
from dforce.forces.van_der_waals import VanDerWaals
from dforce.instrument import Cantilever, Drive, Sample, Tip
from dforce.problem import Instrument, Problem
from dforce.solvers import SolverSettings
from dforce.solvers.integrator import INTEGRATORS, with_amplitudes

DISTANCES = np.linspace(4.1e-9, 7.7e-9, 12)
POINTS = (32, 64, 128, 256, 512, 1024)
SMOOTH = np.array([10.6e-9, 10.8e-9, 11e-9])  # the tip stays outside contact
TEXT = (
    "Errors after four periods, as root mean squares over a dozen distances, against the engine at a tolerance "
    "of 1e-13. The order is the slope of their logarithms. Engine and LSODA choose their steps: their errors "
    "fall with the tolerance. RK4 cuts its steps at kinks and jumps of the force, so these cost "
    "no order. A force that starts like a root does: Hertz' force starts like δ^1.5, with an error of h^2.5 in this step. "
    "Viscous drag starts like δ^0.5, with an error of h^1.5, so its first step is taken in parts."
)


@dataclass(frozen=True)
class Slope:
    """One measurement of an order: the forces, the setting that is refined and its values, and the slope expected.

    `lowest` and `highest` bound the slope.
    """

    name: str
    forces: str
    integrator: str
    setting: str
    values: tuple[float, ...]
    lowest: float
    highest: float
    note: str = ""


ROOTS = "steeper while the error of the smooth part still counts"
TIGHT = (1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
SLOPES = (
    Slope("RK4, smooth force", "smooth", "rk4", "points_per_period", POINTS, 3.9, 4.1),
    Slope("RK4, force with a kink (flat punch)", "spring", "rk4", "points_per_period", POINTS, 3.9, 4.1),
    Slope("RK4, Hertz", "hertz", "rk4", "points_per_period", POINTS[1:], 2.2, 3.7, ROOTS),
    Slope("RK4, force with a jump at contact", "jump", "rk4", "points_per_period", POINTS[1:], 2.2, 3.7, ROOTS),
    Slope("RK4, viscous contact", "root", "rk4", "points_per_period", POINTS[1:], 1.2, 2.7, ROOTS),
    *(
        Slope(f"engine, error against tolerance: {words}", forces, "engine", "relative_tolerance", TIGHT, 0.85, 1.15)
        for forces, words in (
            ("smooth", "smooth force"),
            ("spring", "flat punch"),
            ("hertz", "Hertz"),
            ("jump", "force with a jump"),
        )
    ),
    Slope(
        "engine, error against tolerance: viscous contact",
        "root",
        "engine",
        "relative_tolerance",
        TIGHT,
        0.6,
        1.0,
        "its errors are a twentieth of the loosest tolerance",
    ),
    Slope(
        "LSODA, error against tolerance: viscous contact",
        "root",
        "lsoda",
        "relative_tolerance",
        (1e-5, 1e-6, *TIGHT[:4]),
        0.75,
        1.25,
        "its order changes within the range",
    ),
)


@cache
def _problem(name: str) -> Problem:
    choices: dict[str, list[Force]] = {
        "smooth": [DMT(hamaker="2e-20 J")],
        "spring": [Sneddon(geometry="punch")],
        "hertz": [DMT(hamaker="0 J")],
        "jump": [VanDerWaals(hamaker="2e-20 J", inside="off"), Hertz()],
        "root": [DMT(hamaker="0 J"), KelvinVoigt(viscosity=100.0)],
    }
    # Q = 2, so that RK4 takes as few points as asked for
    return Problem.build(
        Instrument(
            Cantilever(f0="50 kHz", k="0.9 N/m", Q=2),
            Drive(A0="10 nm"),
            Tip(radius="2 nm"),
            Sample(youngs_modulus="20 MPa" if name in ("spring", "root") else "1 GPa"),
        ),
        forces=choices[name],
    )


def ends(name: str, **settings: Any) -> Array:
    """Return the scaled motion after four periods from the free one, at each distance."""
    chosen = SolverSettings(method="transient", **settings)
    integrator = INTEGRATORS[chosen.integrator](_problem(name), chosen, 1)
    found = []
    for zc in SMOOTH if name == "smooth" else DISTANCES:
        integrator.place(float(zc))
        motion, _ = integrator.lock_in(with_amplitudes(integrator, integrator.problem.free), 4)
        found.append(motion.y)
    return np.array(found)


@cache
def _exact(name: str) -> Array:
    return ends(name, integrator="engine", relative_tolerance=1e-13)


def errors(slope: Slope) -> list[float]:
    """Return the errors of a slope, in units of the free amplitude."""
    fixed: dict[str, Any] = {"integrator": slope.integrator}
    if slope.setting == "relative_tolerance":
        fixed["points_per_period"] = 32
    found = []
    for value in slope.values:
        refined = {slope.setting: int(value) if slope.setting == "points_per_period" else value}
        found.append(float(np.sqrt(((ends(slope.forces, **fixed, **refined) - _exact(slope.forces)) ** 2).mean())))
    return found


def measured(slope: Slope) -> float:
    """Return the slope found."""
    power = float(np.polyfit(np.log(slope.values), np.log(errors(slope)), 1)[0])
    return -power if slope.setting == "points_per_period" else power


def checks(quick: bool) -> Iterator[Check]:
    """Give the order of each integrator."""
    for slope in SLOPES:
        if quick and slope.forces in ("spring", "root"):
            continue
        found, middle = measured(slope), 0.5 * (slope.lowest + slope.highest)
        yield Check(
            slope.integrator,
            slope.name,
            found,
            middle,
            "1",
            abs(found - middle),
            slope.highest - middle,
            f"{slope.values[0]:g} to {slope.values[-1]:g} ({slope.setting})",
            slope.note,
        )


def part(quick: bool) -> ValidationPart:
    """Return this part of the validation."""
    return ValidationPart("orders", "Orders of convergence", TEXT, tuple(checks(quick)), {})
