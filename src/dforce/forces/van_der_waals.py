"""Van der Waals attraction of tips of several shapes by a flat sample."""

from __future__ import annotations

from collections.abc import Mapping
from math import sin, tan
from typing import Any, ClassVar, Literal

import pydantic

from dforce.core.parameters import Number, param, shared
from dforce.forces._contract import Force


class VanDerWaals(Force):
    r"""Van der Waals attraction between the tip and a flat, thick sample, not retarded.

    .. math:: F = -\frac{H R}{6 d^2} \quad (d > a_0), \qquad F(d \le a_0) = F(a_0)

    for a sphere much larger than the distance (Derjaguin's approximation). With `inside = "off"` the force is zero at :math:`d
    < a_0`, and jumps there. Other shapes of the tip (:math:`\theta`: half-angle, angle between axis and side; any body of
    revolution gives :math:`F = -\tfrac{H}{2}\int r(z)^2 (d + z)^{-4}\,dz`):

    - `exact_sphere`: :math:`F = -\dfrac{2 H R^3}{3 d^2 (d + 2R)^2}`
    - `capped_cone`, a sphere that continues as a cone from the height :math:`z_t = R(1 - \sin\theta)` without
      an edge, with :math:`D = d + z_t`:
      :math:`F = -\dfrac{H}{6 d^2 D^3}\left[z_t^2 (R z_t + (3R - z_t) d)
      + d^2 (R^2\cos^2\theta + R \sin\theta\, D + \tan^2\theta\, D^2)\right]`
    - `flat`, a punch whose flat end has the radius :math:`R`: :math:`F = -H R^2 / 6 d^3`

    At R = 2 nm Derjaguin's approximation is 8 % too large at contact and 27 % at 0.5 nm. Valid below about 10 nm, without
    retardation.
    """

    name = "van_der_waals"
    title = "van der Waals"
    also_called = ("Hamaker", "dispersion", "London", "Lifshitz")
    contains = ("van der Waals",)
    source = (
        "J. N. Israelachvili, Intermolecular and Surface Forces, Academic Press (2011); "
        "C. Argento, R. H. French, J. Appl. Phys. 80, 6081 (1996)"
    )
    example: ClassVar[Mapping[str, Any]] = {"hamaker": "1e-19 J"}

    radius: float = shared("tip.radius")
    half_angle: float | None = shared("tip.half_angle")
    a0: float = shared("contact.a0")
    hamaker: Number = param(unit="J", symbol="H", doc="Hamaker constant; negative for repulsion across a liquid")
    geometry: Literal["sphere", "exact_sphere", "capped_cone", "flat"] = pydantic.Field(
        "sphere", description="shape of the tip"
    )
    inside: Literal["constant", "off"] = pydantic.Field(
        "constant", description="attraction in contact: its value at a0, or none"
    )

    @property
    def strength(self) -> float:
        """Constant in the numerator: HR/6 of a sphere (N m^2), HR²/6 flat (N m^3), H/6 of a cone (N m)."""
        factor = {"sphere": self.radius, "exact_sphere": self.radius, "capped_cone": 1.0, "flat": self.radius**2}
        return self.hamaker / 6.0 * factor[self.geometry]

    @property
    def c0(self) -> float:
        """First coefficient of the shape's polynomial in the denominator, d²(c0 + c1 d + c2 d²) (1)."""
        return 0.0 if self.geometry == "flat" else 1.0

    @property
    def c1(self) -> float:
        """Second coefficient of the shape's polynomial (1/m; 1 when flat)."""
        return {"exact_sphere": 1.0 / self.radius, "flat": 1.0}.get(self.geometry, 0.0)

    @property
    def c2(self) -> float:
        """Third coefficient of the shape's polynomial (1/m^2)."""
        return 0.25 / self.radius**2 if self.geometry == "exact_sphere" else 0.0

    @property
    def cap(self) -> float:
        """Height at which the cone begins; 0 without a cone (m)."""
        return self.radius * (1.0 - sin(self.needed("half_angle"))) if self.geometry == "capped_cone" else 0.0

    @property
    def slope(self) -> float:
        """Squared tangent of the half-angle; 0 without a cone (1)."""
        return tan(self.needed("half_angle")) ** 2 if self.geometry == "capped_cone" else 0.0

    @property
    def contact_force(self) -> float:
        """Force in contact (N)."""
        if self.inside == "off":
            return 0.0
        return attraction(self.a0, self.strength, self.c0, self.c1, self.c2, self.radius, self.cap, self.slope)

    @staticmethod
    def law(
        d: float,
        rate: float,
        t: float,
        strength: float,
        c0: float,
        c1: float,
        c2: float,
        radius: float,
        cap: float,
        slope: float,
        a0: float,
        contact_force: float,
    ) -> float:
        if d <= a0:
            return contact_force
        return attraction(d, strength, c0, c1, c2, radius, cap, slope)

    def kinks(self) -> tuple[float, ...]:
        return (self.a0,)

    def jumps(self) -> tuple[float, ...]:
        return (self.a0,) if self.inside == "off" else ()


def attraction(
    d: float, strength: float, c0: float, c1: float, c2: float, radius: float, cap: float, slope: float
) -> float:
    """Return the force (N) outside contact."""
    if cap > 0.0:
        far = d + cap
        sphere = cap * cap * (radius * cap + (3.0 * radius - cap) * d)
        cone = cap * (2.0 * radius - cap) + (radius - cap) * far + slope * far * far
        return -strength * (sphere + d * d * cone) / (d * d * far * far * far)
    return -strength / (d * d * (c0 + d * (c1 + d * c2)))
