"""Steady states in closed form, with their approximation: one harmonic, or a small amplitude."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator

import numpy as np

from dforce.case import Case, example
from dforce.checks.validation.checks import Check, ValidationPart
from dforce.checks.validation.comparison import find
from dforce.forces.dmt import DMT
from dforce.forces.van_der_waals import VanDerWaals
from dforce.instrument import Cantilever, Drive, Sample, Tip
from dforce.results.status import whole
from dforce.runs import approach
from dforce.solvers import SolverSettings

POINTS = 1024
TEXT = "Formulas that neglect a small term; the limit is the size of this term."


def _phase_of_a_conservative_force() -> Iterator[Check]:
    """At resonance, without loss and with one harmonic, sin φ = A/A0: the same for every Hamaker constant."""
    for name in ("figure-7-low", "figure-7-high"):
        case = example(name)
        for zc in (15e-9, 10e-9):
            found = find(case, zc, POINTS)
            if found is None:
                raise ArithmeticError(f"{name} does not settle")
            a, lag = float(found.values["mode_amplitude"][0]), float(found.values["mode_phase"][0])
            expected = 180.0 - math.degrees(math.asin(a / case.problem.tones[0].A0))
            yield Check(
                "phase of mode 1 from its amplitude",
                f"{name}, {1e9 * zc:g} nm",
                lag,
                expected,
                "°",
                abs(lag - expected),
                0.012,
                "J. P. Cleveland et al., Appl. Phys. Lett. 72, 2613 (1998): φ = 180° - asin(A/A0) in net attraction",
                "in degrees; drive 2 also moves mode 1",
            )


def _attraction_without_contact() -> Iterator[Check]:
    """Amplitude and phase under -HR/6d² alone, with one harmonic."""
    from scipy.optimize import brentq

    case = example("figure-3-air")
    mode, tone, force = case.problem.modes[0], case.problem.tones[0], case.problem.forces[0]
    strength = force.H * force.radius / 6.0  # type: ignore[attr-defined]
    for zc in (15e-9, 12e-9, 11e-9):

        def bend(a: float, zc: float = zc) -> float:
            """Return the mean deflection at an amplitude."""
            return float(
                brentq(lambda z: mode.k * z + strength * (zc + z) / ((zc + z) ** 2 - a * a) ** 1.5, -0.1e-9, 0.0)
            )

        def balance(a: float, zc: float = zc) -> float:
            gap = (zc + bend(a)) ** 2 - a * a
            drive = 0.5 * mode.k * a * tone.A0 / mode.Q * math.sqrt(1.0 - (a / tone.A0) ** 2)
            return float(drive - strength * a * a / gap**1.5)

        a = float(brentq(balance, 0.9 * tone.A0, tone.A0 * (1.0 - 1e-12), xtol=1e-20, rtol=1e-14))
        lag = 180.0 - math.degrees(math.asin(a / tone.A0))
        found = find(case, zc, POINTS)
        if found is None:
            raise ArithmeticError("figure 3 does not settle")
        for name, value, expected, unit in (
            ("amplitude", float(found.values["amplitude"][0]), a, "m"),
            ("phase", float(found.values["phase"][0]), lag, "°"),
        ):
            yield Check(
                "attraction without contact",
                f"figure-3-air, {1e9 * zc:g} nm: {name}",
                value,
                expected,
                unit,
                abs(value - expected) / expected,
                4e-4,
                "A. San Paulo, R. Garcia, Phys. Rev. B 64, 193411 (2001): (k A A0/2Q) √(1 - A²/A0²) = ⟨F z⟩ over a cosine",
                "harmonics are neglected",
            )


def _small_amplitude() -> Iterator[Check]:
    """A small motion feels the force as a spring -dF/dd at the mean distance."""
    hamaker, radius, zc, free = 1e-19, 2e-9, 3e-9, 0.2e-12
    case = Case(
        cantilever=Cantilever(f0=50e3, k=1.0, Q=100.0),
        drive=Drive(A0=free),
        tip=Tip(radius=radius),
        sample=Sample(youngs_modulus=1e9),
        forces=[DMT(hamaker=hamaker)],
    )
    found = find(case, zc, POINTS)
    if found is None:
        raise ArithmeticError("the small motion does not settle")
    d = zc + float(found.values["mean_deflection"])
    x = 0.01 / complex(-hamaker * radius / (3.0 * d**3), 0.01)
    rows = (
        ("amplitude", float(found.values["amplitude"][0]), abs(x) * free, "m"),
        ("phase", float(found.values["phase"][0]), -math.degrees(cmath.phase(x)), "°"),
        ("mean deflection", float(found.values["mean_deflection"]), -hamaker * radius / (6.0 * d * d), "m"),
    )
    for name, value, expected, unit in rows:
        yield Check(
            "small amplitude",
            name,
            value,
            expected,
            unit,
            abs(value - expected) / abs(expected),
            1e-6,
            "T. R. Albrecht, P. Grütter, D. Horne, D. Rugar, J. Appl. Phys. 69, 668 (1991): the resonance shifts with dF/dd",
            "A0 = 0.2 pm at 3 nm: the neglected terms are the square of their ratio, times Q",
        )


def _frequency_shift() -> Iterator[Check]:
    """The frequency shift of FM-AFM under -HR/6d² alone, with one harmonic: a stiff lever has hardly more."""
    from scipy.optimize import brentq

    hamaker, radius, A0 = 2e-20, 2e-9, 10e-9
    case = Case(
        cantilever=Cantilever(f0=30e3, k=1800.0, Q=1e4),
        drive=Drive(A0=A0, operation="fm"),
        tip=Tip(radius=radius),
        forces=[VanDerWaals(hamaker=hamaker)],
        solver=SolverSettings(integrator="engine", accuracy=1e-9),
    )
    mode, strength = case.problem.modes[0], hamaker * radius / 6.0
    distances = (12e-9, 10.5e-9)
    curve = whole(approach(case, zc=distances))
    for zc, found in zip(distances, curve["frequency_shift"].values[:, 0].tolist(), strict=True):

        def bend(z: float, zc: float = zc) -> float:
            return float(mode.k * (z - zc) + strength * z / (z * z - A0 * A0) ** 1.5)

        gap = float(brentq(bend, zc - 0.01e-9, zc, xtol=1e-20, rtol=1e-14)) ** 2 - A0**2
        expected = mode.f0 * (math.sqrt(1.0 - 2.0 * strength / (mode.k * gap**1.5)) - 1.0)
        yield Check(
            "frequency shift of an attraction",
            f"k = 1800 N/m, A = 10 nm, {1e9 * zc:g} nm",
            found,
            expected,
            "Hz",
            abs(found / expected - 1.0),
            1e-4,
            "F. J. Giessibl, Phys. Rev. B 56, 16010 (1997): Δf from ⟨F z⟩ over a cosine, here with the square root",
            "harmonics are neglected",
        )


def part(quick: bool) -> ValidationPart:
    """Return this part of the validation."""
    sources = [
        _attraction_without_contact,
        _small_amplitude,
        _frequency_shift,
        *([] if quick else [_phase_of_a_conservative_force]),
    ]
    checks = tuple(check for source in sources for check in source())
    if not np.isfinite([check.error for check in checks]).all():
        raise ArithmeticError("a closed form has no value")
    return ValidationPart("closed_forms", "Closed forms", TEXT, checks, {})
