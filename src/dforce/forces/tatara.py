"""Elastic compression of a small sphere between tip and support."""

from __future__ import annotations

from math import pi, sqrt
from typing import Literal

import pydantic

from dforce.core.parameters import shared
from dforce.forces._contract import Force

KAPPA_FOLD = 2.0 / (3.0 * sqrt(3.0))  # beyond it the law has no solution
KAPPA_LIMIT = 0.9 * KAPPA_FOLD


class Tatara(Force):
    r"""Compression of a spherical sample between the tip and its support, with two equal contacts.

    .. math:: \frac{\delta}{2} = \left(\frac{F}{n}\right)^{2/3} - \frac{F}{n_c}, \qquad
        n = \tfrac{4}{3} E_\mathrm{eff} \sqrt{R_\mathrm{eff}}

    with :math:`1/R_\mathrm{eff} = 1/R_t + 1/R_s` and :math:`1/n_c = (3 + \nu_t - 2\nu_t^2)/4\pi E_t R_t
    + (3 + \nu_s - 2\nu_s^2)/4\pi E_s R_s`. Each side has half of the compression: Hertz' approach minus the displacement of the
    opposite pole. As a series, with the option `form`:

    .. math:: F = \frac{n\,\delta^{3/2}}{2^{3/2}} + \frac{3 n^2 \delta^2}{8 n_c}
        + \frac{21 n^3 \delta^{5/2}}{2^{11/2} n_c^2}

    (`series_15`: with 15 in place of 21, as in some papers). A tip without a modulus is rigid. Valid for compressions small
    relative to both radii. The implicit law has no solution beyond :math:`\delta = 8 n_c^2/27 n^2`; from 81 % of this
    compression the force continues along its tangent.
    """

    name = "tatara"
    also_called = ("particle compression", "double contact", "nanoparticle")
    contains = ("elastic contact",)
    source = "Y. Tatara, J. Eng. Mater. Technol. 113, 285 (1991); derived again here"

    radius: float = shared("tip.radius")
    tip_modulus: float | None = shared("tip.youngs_modulus")
    tip_poisson: float | None = shared("tip.poisson_ratio")
    sample_radius: float = shared("sample.radius")
    sample_modulus: float = shared("sample.youngs_modulus")
    sample_poisson: float = shared("sample.poisson_ratio")
    E_eff: float = shared("contact.E_eff")
    a0: float = shared("contact.a0")
    form: Literal["implicit", "series", "series_15"] = pydantic.Field(
        "implicit", description="form of the law: the law itself, or its series"
    )

    @property
    def n(self) -> float:
        """Force per indentation of one contact to the power 3/2 (N/m^1.5)."""
        return 4.0 / 3.0 * self.E_eff / sqrt(1.0 / self.radius + 1.0 / self.sample_radius)

    @property
    def n_c(self) -> float:
        """Force per displacement of the opposite pole (N/m)."""
        nu = self.sample_poisson
        softness = (3.0 + nu - 2.0 * nu**2) / (self.sample_modulus * self.sample_radius)
        if self.tip_modulus is not None:
            nu = self.needed("tip_poisson")
            softness += (3.0 + nu - 2.0 * nu**2) / (self.tip_modulus * self.radius)
        return 4.0 * pi / softness

    @property
    def stiffness(self) -> float:
        """Leading force per compression to the power 3/2 (N/m^1.5)."""
        return self.n / sqrt(8.0)

    @property
    def ratio(self) -> float:
        """Displacement of the poles against Hertz' approach, per root of the compression (m^-0.5)."""
        return self.n / self.n_c * sqrt(0.5)

    @property
    def last(self) -> float:
        """Third coefficient of the series, 0 for the implicit law (1)."""
        return {"implicit": 0.0, "series": 21.0 / 8.0, "series_15": 15.0 / 8.0}[self.form]

    @property
    def limit(self) -> float:
        """Compression from which on the force follows its tangent (m)."""
        return (KAPPA_LIMIT / self.ratio) ** 2

    @staticmethod
    def law(
        d: float, rate: float, t: float, stiffness: float, ratio: float, last: float, limit: float, a0: float
    ) -> float:
        depth = a0 - d
        if depth <= 0.0:
            return 0.0
        if last > 0.0:
            kappa = ratio * sqrt(depth)
            return stiffness * depth * sqrt(depth) * (1.0 + kappa * (1.5 + last * kappa))
        inside = depth if depth < limit else limit
        root = sqrt(inside)
        kappa = ratio * root
        w = inverse_root(kappa)
        force = stiffness * inside * root / (w * w * w)
        if depth > limit:
            # the slope at the limit, from the derivative of the implicit law
            force += stiffness * root / w * 1.5 / (1.0 - 1.5 * kappa / w) * (depth - limit)
        return force

    def kinks(self) -> tuple[float, ...]:
        return (self.a0,) if self.last > 0.0 else (self.a0, self.a0 - self.limit)


def inverse_root(kappa: float) -> float:
    """Return the largest root of w³ - w + kappa = 0: Hertz' force over Tatara's to the power 1/3.

    Newton's method comes down from w = 1, where Hertz' law is; five steps suffice up to the limit on kappa.
    """
    w = 1.0
    for _ in range(6):
        square = w * w
        w -= (w * (square - 1.0) + kappa) / (3.0 * square - 1.0)
    return w
