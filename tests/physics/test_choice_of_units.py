"""No solver knows the size of a meter, kilogram or second: a case in other units gives the same curve in them."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pint
from every import every

import dforce as df
from dforce.case.paths import changed, paths, quantity_at, value_at
from dforce.forces import REGISTRY

# Velocities are equal in both systems, and so is the magnetic constant. The unit of charge keeps the electric constant, and
# the unit of temperature keeps Boltzmann's constant.
LENGTH, MASS, TIME = 3.0, 0.5, 3.0
ENERGY = MASS * LENGTH**2 / TIME**2
CHARGE = sqrt(ENERGY * LENGTH)
BASE = {
    "[length]": LENGTH,
    "[mass]": MASS,
    "[time]": TIME,
    "[temperature]": ENERGY,
    "[current]": CHARGE / TIME,
    "[substance]": 1.0,
}
UNITS = pint.UnitRegistry()
PHYSICAL = ("cantilever.", "drive.", "tip.", "sample.", "contact.", "medium.", "forces.", "experiment.")
LEVER = {
    "cantilever": {"f0": "50 kHz", "k": "5 N/m", "Q": 5},
    "drive": {"A0": "20 nm"},
    "tip": {"radius": "10 nm", "youngs_modulus": "170 GPa", "poisson_ratio": 0.28, "half_angle": "20 deg"},
    "sample": {"youngs_modulus": "1 GPa", "poisson_ratio": 0.3, "thickness": "500 nm", "radius": "50 nm"},
    "medium": {"temperature": "298.15 K", "permittivity": 78.5},
}
STORED = 5.0 * 20e-9**2  # k A0² (J)
# the numbers in the law of `custom` have no declared units
LAWS = sorted(
    name for name, model in REGISTRY.items() if model.__module__.startswith("dforce.forces.") and name != "custom"
)


def factor(unit: str) -> float:
    """Return how many new units are in one old unit."""
    if unit in ("1", "%", "", "degree"):
        return 1.0
    powers = UNITS.parse_units(unit).dimensionality
    return float(np.prod([BASE[str(name)] ** float(power) for name, power in powers.items()]))


def in_other_units(case: df.Case) -> df.Case:
    new = []
    for path in paths(case):
        value = value_at(case, path)
        numbers = value if isinstance(value, tuple) else (value,)
        if path.startswith(PHYSICAL) and value and all(type(number) is float for number in numbers):
            scaled = [factor(quantity_at(case, path).unit) * number for number in numbers]
            new.append((path, scaled if isinstance(value, tuple) else scaled[0]))
    return df.Case(**changed(case, new))


@every(LAWS)
def test_a_curve_is_the_same_in_other_units(name):
    grid = {"start": "23 nm", "stop": "8 nm", "points": 6}
    force = {"model": name, **REGISTRY[name].example}
    case = df.Case(**LEVER, forces=[force], experiment={"kind": "approach", "zc": grid})
    old, new = df.run(case), df.run(in_other_units(case))
    np.testing.assert_array_equal(new.status, old.status)
    np.testing.assert_allclose(new.zc, LENGTH * old.zc, rtol=1e-12)
    for quantity in (
        "amplitude",
        "phase",
        "peak_force",
        "min_force",
        "mean_force",
        "min_distance",
        "total_dissipated_energy",
    ):
        expected = factor(old[quantity].attrs["units"]) * old[quantity].values
        none = (
            1e-4 * factor("J") * STORED if quantity == "total_dissipated_energy" else 0.0
        )  # most samples dissipate nothing
        size = np.nanmax(np.abs(expected), initial=none)
        np.testing.assert_allclose(new[quantity], expected, rtol=0.0, atol=1e-6 * size, err_msg=quantity)
