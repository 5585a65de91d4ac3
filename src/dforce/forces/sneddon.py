"""Elastic contact of tips of several shapes."""

from __future__ import annotations

from math import pi, sqrt, tan, tanh
from typing import Literal

import pydantic

from dforce.core.parameters import shared
from dforce.forces._contract import Force


class Sneddon(Force):
    r"""Elastic contact of a cone, a pyramid, a flat punch or an exact sphere with a flat, thick sample.

    .. math:: F = \tfrac{2}{\pi} E_\mathrm{eff} \tan\theta\; \delta^2 \quad\text{(cone)},
        \qquad \delta = a_0 - d > 0

    - `pyramid` with four sides, :math:`\theta` between axis and face: :math:`F = E_\mathrm{eff} \tan\theta\,
      \delta^2 / \sqrt{2}`
    - `punch`, a flat end of the radius :math:`R`: :math:`F = 2 E_\mathrm{eff} R\, \delta`
    - `exact_sphere`, not the paraboloid of `hertz`, contact radius :math:`a`:
      :math:`\delta = a\, \mathrm{artanh}(a/R)`,
      :math:`F = E_\mathrm{eff} [(a^2 + R^2)\, \mathrm{artanh}(a/R) - a R]`

    Valid for thick samples without adhesion, small strains (blunt cones), and spheres with indentations below their radius. The
    pyramid is Bilodeau's approximation.
    """

    name = "sneddon"
    also_called = ("cone", "pyramid", "Bilodeau", "Love", "flat punch", "indenter")
    contains = ("elastic contact",)
    source = "I. N. Sneddon, Int. J. Eng. Sci. 3, 47 (1965); G. G. Bilodeau, J. Appl. Mech. 59, 519 (1992)"

    radius: float | None = shared("tip.radius")
    half_angle: float | None = shared("tip.half_angle")
    E_eff: float = shared("contact.E_eff")
    a0: float = shared("contact.a0")
    geometry: Literal["cone", "pyramid", "punch", "exact_sphere"] = pydantic.Field(
        "cone", description="shape of the tip"
    )

    @property
    def linear(self) -> float:
        """Force per indentation of a punch, else 0 (N/m)."""
        return 2.0 * self.E_eff * self.needed("radius") if self.geometry == "punch" else 0.0

    @property
    def quadratic(self) -> float:
        """Force per squared indentation of a cone or pyramid, else 0 (N/m^2)."""
        if self.geometry not in ("cone", "pyramid"):
            return 0.0
        factor = 2.0 / pi if self.geometry == "cone" else sqrt(0.5)
        return factor * self.E_eff * tan(self.needed("half_angle"))

    @property
    def sphere(self) -> float:
        """Radius of the exact sphere, else 0 (m)."""
        return self.needed("radius") if self.geometry == "exact_sphere" else 0.0

    @staticmethod
    def law(
        d: float, rate: float, t: float, linear: float, quadratic: float, sphere: float, E_eff: float, a0: float
    ) -> float:
        depth = a0 - d
        if depth <= 0.0:
            return 0.0
        if sphere > 0.0:
            return E_eff * sphere * sphere * sphere_force(depth / sphere)
        return depth * (linear + quadratic * depth)

    def kinks(self) -> tuple[float, ...]:
        return (self.a0,)


def sphere_force(depth: float) -> float:
    """Return the force over E_eff R² of a sphere at an indentation given in radii.

    The unknown is y = artanh(a/R), from y tanh(y) = depth. Newton's method starts within 5 % of it, and
    its error after n steps is below 0.05 to the power 2^n.
    """
    y = sqrt(depth + depth * depth * (1.0 - 0.5 / (1.0 + depth)))
    for _ in range(4):
        s = tanh(y)
        y -= (y * s - depth) / (s + y * (1.0 - s * s))
    s = tanh(y)
    return (1.0 + s * s) * y - s
