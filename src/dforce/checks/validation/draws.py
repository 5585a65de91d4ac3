"""Random cases, each given again by its seed and number: parameters drawn over a fixed list of sums of forces.

The sums together hold every shipped force. Parameters are random, the sums are not: each costs a compilation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce.case import Case

RATIOS = (6.0, 6.2, 6.25, 5.5, 6.5)  # of the second frequency to the first, so that the tones have a common period
PULLS = 10.0  # the spring's least pull k A0 over such an adhesion: a weaker one leaves the tip stuck for good
Tables = list[dict[str, Any]]


@dataclass(frozen=True)
class Draw:
    """A random case: its number, the sum of forces it was drawn for, and the case with a dwell as experiment."""

    number: int
    family: str
    case: Case

    @property
    def zc(self) -> float:
        """The average distance (m)."""
        return float(self.case.experiment.zc)  # type: ignore[union-attr]

    @property
    def text(self) -> str:
        """Its main numbers in a line."""
        mode, tone = self.case.problem.modes[0], self.case.problem.tones[0]
        return (
            f"{self.family}, Q = {mode.Q:.3g}, k = {mode.k:.3g} N/m, A0 = {1e9 * tone.A0:.3g} nm, "
            f"zc = {1e9 * self.zc:.4g} nm"
        )


class _Rng:
    """Random numbers as experiments have them: spread evenly over orders of magnitude."""

    def __init__(self, seed: int, number: int) -> None:
        self.rng = np.random.default_rng([seed, number])

    def even(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def decades(self, low: float, high: float) -> float:
        return math.exp(self.even(math.log(low), math.log(high)))


def _hertz(r: _Rng) -> Tables:
    return [{"model": "hertz"}]


def _dmt(r: _Rng) -> Tables:
    return [{"model": "dmt", "hamaker": r.decades(1e-21, 2e-19)}]


def _attraction_that_stops(r: _Rng) -> Tables:
    return [{"model": "van_der_waals", "hamaker": r.decades(1e-21, 2e-19), "inside": "off"}, {"model": "hertz"}]


def _viscous(r: _Rng) -> Tables:
    return [{"model": "hertz"}, {"model": "kelvin_voigt", "viscosity": r.decades(0.1, 300.0)}]


def _viscous_dmt(r: _Rng) -> Tables:
    return [*_dmt(r), {"model": "kelvin_voigt", "viscosity": r.decades(0.1, 300.0)}]


def _jkr(r: _Rng) -> Tables:
    return [{"model": "jkr", "surface_energy": r.decades(1e-3, 0.1)}]


def _maugis(r: _Rng) -> Tables:
    moment = r.decades(1e-19, 3e-18)
    return [
        {"model": "maugis_dugdale", "surface_energy": r.decades(1e-3, 0.1)},
        {"model": "electrostatic", "bias": r.even(0.0, 2.0)},
        {"model": "magnetic_dipole", "tip_moment": moment, "sample_moment": moment},
    ]


def _solid(r: _Rng) -> dict[str, float]:
    instant = r.decades(1e7, 2e9)
    return {
        "instant_modulus": instant,
        "relaxed_modulus": instant * r.even(0.05, 0.9),
        "relaxation_time": r.decades(1e-6, 1e-4),
    }


def _remembering(r: _Rng) -> Tables:
    return [
        {"model": "sls", "elements": 16, **_solid(r)},
        {"model": "capillary", "volume": r.decades(5e-27, 5e-26), "formation": r.even(0.3e-9, 1e-9)},
    ]


def _simple_solid(r: _Rng) -> Tables:
    return [{"model": "sls_simple", **_solid(r)}, {"model": "van_der_waals", "hamaker": r.decades(1e-21, 2e-19)}]


def _maxwell(r: _Rng) -> Tables:
    arms = [r.decades(1e7, 1e9), r.decades(1e7, 1e9)]
    return [
        {
            "model": "generalized_maxwell",
            "elements": 8,
            "relaxed_modulus": r.decades(1e7, 1e9),
            "arm_moduli": arms,
            "arm_times": [r.decades(1e-6, 1e-5), r.decades(1e-5, 1e-4)],
        }
    ]


def _power_law(r: _Rng) -> Tables:
    return [
        {
            "model": "power_law",
            "elements": 8,
            "modulus_at_reference": r.decades(1e7, 1e9),
            "reference_time": 1e-5,
            "exponent": r.even(0.05, 0.4),
            "shortest_time": 1e-6,
            "longest_time": 1e-4,
        },
        {"model": "hydration", "energy": r.decades(1e-3, 1e-2), "decay": r.even(0.2e-9, 1e-9)},
    ]


def _in_water(r: _Rng) -> Tables:
    return [
        {
            "model": "dlvo",
            "hamaker": r.decades(1e-21, 2e-20),
            "debye_length": r.decades(0.5e-9, 1e-8),
            "tip_charge": -r.decades(1e-3, 0.05),
            "sample_charge": -r.decades(1e-3, 0.05),
        },
        {"model": "sneddon", "geometry": "cone"},
        {"model": "solvation", "amplitude": r.decades(1e-12, 1e-9), "molecule": r.even(0.25e-9, 0.8e-9)},
    ]


def _hysteretic(r: _Rng) -> Tables:
    energy = r.decades(1e-3, 0.05)
    return [
        {"model": "adhesion_hysteresis", "approach_energy": energy, "retract_energy": energy * r.even(1.0, 2.0)},
        {"model": "hertz"},
    ]


def _small_sphere(r: _Rng) -> Tables:
    return [{"model": "tatara"}, {"model": "morse", "bond_energy": r.decades(5e-20, 3e-19)}]


def _thin(r: _Rng) -> Tables:
    return [
        {"model": "bottom_effect"},
        {"model": "kelvin_voigt", "geometry": "cone", "viscosity": r.decades(0.1, 100.0)},
        {"model": "custom", "law": "-P1 * exp(-max(d, a0) / P2)", "P1": r.decades(1e-11, 1e-9), "P2": 5e-10},
    ]


def _atoms(r: _Rng) -> Tables:
    return [
        {"model": "lennard_jones", "work_of_adhesion": r.decades(1e-3, 0.1), "equilibrium": r.even(0.165e-9, 0.4e-9)}
    ]


@dataclass(frozen=True)
class Family:
    """A sum of forces with random parameters, and how many modes and tones the cantilever has."""

    forces: Callable[[_Rng], Tables]
    modes: int = 1
    share: int = 1


FAMILIES = {
    "Hertz": Family(_hertz, share=2),
    "DMT": Family(_dmt, share=3),
    "van der Waals that ends at contact, Hertz": Family(_attraction_that_stops, share=2),
    "Hertz, Kelvin–Voigt": Family(_viscous, share=2),
    "DMT, bimodal": Family(_dmt, 2, share=2),
    "Hertz, bimodal": Family(_hertz, 2, share=2),
    "DMT, Kelvin–Voigt": Family(_viscous_dmt),
    "JKR": Family(_jkr),
    "Maugis–Dugdale, electrostatic, magnetic": Family(_maugis),
    "standard linear solid, capillary": Family(_remembering),
    "simple standard linear solid, van der Waals": Family(_simple_solid),
    "generalized Maxwell": Family(_maxwell),
    "power law, hydration": Family(_power_law),
    "DLVO, Sneddon, solvation": Family(_in_water),
    "adhesion hysteresis, Hertz": Family(_hysteretic),
    "Tatara, Morse": Family(_small_sphere),
    "bottom effect, Kelvin–Voigt, custom": Family(_thin),
    "Lennard-Jones": Family(_atoms),
}
QUICK = ("Hertz", "DMT", "van der Waals that ends at contact, Hertz", "Hertz, Kelvin–Voigt", "DMT, bimodal")


def draw(seed: int, number: int, families: tuple[str, ...] = tuple(FAMILIES)) -> Draw:
    """Return the random case of a seed and a number: Q from 1 to 2000, A0 from 0.1 to 100 nm, one mode or two."""
    places = [name for name in families for _ in range(FAMILIES[name].share)]
    name = places[number % len(places)]
    family, r = FAMILIES[name], _Rng(seed, number)
    f0, k, Q, A0 = r.decades(2e4, 4e5), r.decades(0.1, 50.0), r.decades(1.0, 2000.0), r.decades(0.1e-9, 100e-9)
    ratio = RATIOS[int(r.even(0.0, len(RATIOS)))]
    radius, forces = r.decades(1e-9, 50e-9), family.forces(r)
    k = max(k, PULLS * _adhesion(radius, forces) / A0)
    second = {"f0": ratio * f0, "k": 39.0 * k * r.even(0.9, 1.1), "Q": min(2.5 * Q, 2000.0)}
    tones = [{"A0": A0}, {"A0": A0 * r.even(0.01, 0.2)}]
    case = Case(
        cantilever={"modes": [{"f0": f0, "k": k, "Q": Q}, second][: family.modes]},
        drive={"tones": tones[: family.modes]},
        tip={
            "radius": radius,
            "youngs_modulus": 170e9,
            "poisson_ratio": 0.28,
            "half_angle": math.radians(r.even(10.0, 35.0)),
        },
        sample={
            "youngs_modulus": r.decades(1e7, 2e10),
            "poisson_ratio": r.even(0.0, 0.5),
            "thickness": r.decades(2e-8, 1e-6),
            "radius": r.decades(5e-9, 1e-7),
        },
        medium="water",
        forces=forces,
        experiment={"kind": "dwell", "zc": 0.165e-9 + A0 * r.even(0.3, 1.02)},
    )
    return Draw(number, name, case)


def _adhesion(radius: float, forces: Tables) -> float:
    """Return the force (N) that holds a tip back after contact, by forces with hysteresis."""
    keys = ("retract_energy", "surface_energy")
    energies = [float(table[key]) for table in forces for key in keys if key in table]
    energies += [0.072 if table["model"] == "capillary" else 0.0 for table in forces]
    return 4.0 * math.pi * radius * max(energies)
