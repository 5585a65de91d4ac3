"""Elastic contact with a thin sample on a stiff support."""

from __future__ import annotations

from functools import lru_cache
from math import pi, sqrt, tan
from typing import Literal

import pydantic

from dforce.core.parameters import shared
from dforce.forces import _layer
from dforce.forces._contract import Force

SERIES_LIMIT = {"cone": 0.8, "sphere": 0.5}  # there the series of an incompressible layer is 1 % off
JOIN = {"cone": 0.3, "sphere": 0.2}  # to here it is good to 1e-4
TABLE_LIMIT = {"cone": 3.0, "sphere": 2.0}
TERMS = 7  # of the polynomial that carries the series to the table's end, to 1e-3


class BottomEffect(Force):
    r"""Elastic contact with a sample of thickness :math:`h` on a rigid support (bottom effect correction).

    .. math:: F = \tfrac{2}{\pi} E_\mathrm{eff} \tan\theta\,\delta^2
        \left[1 + c_1 X + c_2 X^2 + c_3 X^3 + c_4 X^4\right], \qquad X = \tan\theta\,\delta/h
        \quad\text{(cone)}

    - `sphere`: Hertz' force times the bracket in :math:`X = \sqrt{R\delta}/h`
    - `punch`, a flat end of the radius :math:`R`: :math:`2 E_\mathrm{eff} R\,\delta` times the bracket in
      :math:`X = R/h`

    The coefficients follow from the layer's kernel
    :math:`L(\omega) = (2\kappa\sinh 2\omega - 4\omega) / (2\kappa\cosh 2\omega + 4\omega^2 + 1 + \kappa^2)`,
    :math:`\kappa = 3 - 4\nu`, for any Poisson ratio of the sample. With `form = "series"` the bracket is this series up to
    :math:`X = 0.5` (sphere) and 0.8 (cone), where it is 1 % off for :math:`\nu = 0.5`; beyond, the force continues along its
    tangent. With `form = "numerical"` a solution of the integral equation of the contact continues the series. This solution
    is computed at the start of a run, with an accuracy of 1e-3 up to :math:`X = 2` (sphere) and 3 (cone); beyond, the force
    continues along its tangent. Valid for supports much stiffer than the sample, no friction below the tip and no adhesion.
    """

    name = "bottom_effect"
    title = "Thin sample (bottom effect)"
    also_called = (
        "bottom effect correction",
        "Dimitriadis",
        "Gavara",
        "substrate effect",
        "finite thickness",
        "thin film",
        "thin layer",
    )
    contains = ("elastic contact",)
    source = (
        "N. Gavara, R. S. Chadwick, Nat. Nanotechnol. 7, 733 (2012); P. D. Garcia, R. Garcia, Biophys. J. "
        "114, 2923 (2018); coefficients derived again for dForce and checked against the integral equation"
    )

    radius: float | None = shared("tip.radius")
    half_angle: float | None = shared("tip.half_angle")
    thickness: float = shared("sample.thickness")
    poisson: float = shared("sample.poisson_ratio")
    E_eff: float = shared("contact.E_eff")
    a0: float = shared("contact.a0")
    geometry: Literal["cone", "sphere", "punch"] = pydantic.Field("cone", description="shape of the tip")
    form: Literal["numerical", "series"] = pydantic.Field(
        "numerical", description="form of the law: the series continued by the numerical solution, or the series alone"
    )

    @property
    def linear(self) -> float:
        """Force per indentation of a punch, with its correction, else 0 (N/m)."""
        if self.geometry != "punch":
            return 0.0
        radius = self.needed("radius")
        reach = radius / self.thickness
        if self.form == "series":
            ratio = polynomial(reach, coefficients("punch", self.poisson))
        else:
            ratio = _layer.contact("punch", self.poisson, reach)[1]
        return 2.0 * self.E_eff * radius * ratio

    @property
    def blunt(self) -> float:
        """Half-space force of a sphere per indentation to the power 3/2, else 0 (N/m^1.5)."""
        return 4.0 / 3.0 * self.E_eff * sqrt(self.needed("radius")) if self.geometry == "sphere" else 0.0

    @property
    def sharp(self) -> float:
        """Half-space force of a cone per squared indentation, else 0 (N/m^2)."""
        return 2.0 / pi * self.E_eff * tan(self.needed("half_angle")) if self.geometry == "cone" else 0.0

    @property
    def reach_blunt(self) -> float:
        """X of a sphere per root of the indentation, else 0 (m^-0.5)."""
        return sqrt(self.needed("radius")) / self.thickness if self.geometry == "sphere" else 0.0

    @property
    def reach_sharp(self) -> float:
        """X of a cone per indentation, else 0 (1/m)."""
        return tan(self.needed("half_angle")) / self.thickness if self.geometry == "cone" else 0.0

    @property
    def series(self) -> tuple[float, ...]:
        """Coefficients of X to X^4 (1)."""
        return (0.0,) * 4 if self.geometry == "punch" else coefficients(self.geometry, self.poisson)

    @property
    def join(self) -> float:
        """X from which on the numerical solution is added (1)."""
        return JOIN.get(self.geometry, 1.0)

    @property
    def table(self) -> tuple[float, ...]:
        """Coefficients of X - join and its powers: the numerical solution less the series (1)."""
        if self.form == "series" or self.geometry == "punch":
            return (0.0,) * TERMS
        return difference(self.geometry, self.poisson)

    @property
    def deepest(self) -> float:
        """Indentation from which on the force follows its tangent (m)."""
        if self.geometry == "punch":
            return self.thickness  # the law is linear: its tangent is itself
        limit = (SERIES_LIMIT if self.form == "series" else TABLE_LIMIT)[self.geometry]
        if self.geometry == "sphere":
            return (limit / self.reach_blunt) ** 2
        return limit / self.reach_sharp

    @staticmethod
    def law(
        d: float,
        rate: float,
        t: float,
        linear: float,
        blunt: float,
        sharp: float,
        reach_blunt: float,
        reach_sharp: float,
        series: tuple[float, ...],
        join: float,
        table: tuple[float, ...],
        deepest: float,
        a0: float,
    ) -> float:
        depth = a0 - d
        if depth <= 0.0:
            return 0.0
        inside = depth if depth < deepest else deepest
        root = sqrt(inside)
        x = root * (reach_blunt + reach_sharp * root)
        ratio = polynomial(x, series)
        if x > join:
            ratio += polynomial(x - join, table) - 1.0
        base = inside * (linear + root * (blunt + sharp * root))
        force = base * ratio
        if depth > deepest:
            slope = linear + root * (1.5 * blunt + 2.0 * sharp * root)
            growth = slopes(x, series)
            if x > join:
                growth += slopes(x - join, table)
            # dX/d(depth) is X/2 depth for a sphere and X/depth for a cone
            bend = root * (0.5 * reach_blunt + reach_sharp * root) / inside
            force += (slope * ratio + base * growth * bend) * (depth - deepest)
        return force

    def kinks(self) -> tuple[float, ...]:
        if self.geometry == "punch":
            return (self.a0,)
        return (self.a0, self.a0 - self.deepest)


def polynomial(x: float, coefficients: tuple[float, ...]) -> float:
    """Return 1 + c1 x + c2 x² + ..."""
    total = 0.0
    for i in range(len(coefficients) - 1, -1, -1):
        total = (total + coefficients[i]) * x
    return 1.0 + total


def slopes(x: float, coefficients: tuple[float, ...]) -> float:
    """Return the derivative of 1 + c1 x + c2 x² + ..."""
    total = 0.0
    for i in range(len(coefficients) - 1, -1, -1):
        total = total * x + (i + 1.0) * coefficients[i]
    return total


def coefficients(geometry: str, poisson: float) -> tuple[float, float, float, float]:
    """Return c1 to c4 of a tip's shape for the Poisson ratio of the sample."""
    a, b = _layer.kernel_moments(poisson)
    p = pi**2
    if geometry == "sphere":
        return (
            -2.0 * a / pi,
            14.0 * a**2 / (3.0 * p),
            32.0 / pi**3 * (-50.0 * a**3 - 9.0 * p * b) / 135.0,
            4.0 * a * (715.0 * a**3 + 288.0 * p * b) / (90.0 * p**2),
        )
    if geometry == "cone":
        return (
            -4.0 * a / p,
            20.0 * a**2 / p**2,
            16.0 * (-7.0 * a**3 - p * b) / p**3,
            224.0 * a * (3.0 * a**3 + p * b) / p**4,
        )
    return (
        -2.0 * a / pi,
        4.0 * a**2 / p,
        8.0 * (-3.0 * a**3 - p * b) / (3.0 * pi**3),
        16.0 * a * (3.0 * a**3 + 2.0 * p * b) / (3.0 * p**2),
    )


@lru_cache(maxsize=64)
def difference(geometry: str, poisson: float) -> tuple[float, ...]:
    """Return the polynomial in X - join that carries the series over to the numerical solution."""
    import numpy as np

    limit, join = TABLE_LIMIT[geometry], JOIN[geometry]
    # the contact radius is at most 1.6 X for a sphere and 1.4 X for a cone
    solved = np.array([_layer.contact(geometry, poisson, a) for a in np.linspace(join, 1.6 * limit, 60)])
    x, ratio = solved[(solved[:, 0] > join) & (solved[:, 0] < 1.05 * limit)].T
    series = np.array([polynomial(place, coefficients(geometry, poisson)) for place in x])
    rest = ratio - series
    powers = np.stack([(x - join) ** (i + 2) for i in range(TERMS - 1)], axis=1)
    fitted = np.linalg.lstsq(powers / ratio[:, None], rest / ratio, rcond=None)[0]
    # the first coefficient is zero: the law keeps its slope at the join
    return (0.0, *map(float, fitted))
