"""Force between two magnetic dipoles on one axis."""

from __future__ import annotations

from math import pi

from dforce.core.parameters import Number, param, shared
from dforce.forces._contract import Force

MU_0 = 1.25663706212e-6  # N/A^2, CODATA 2018


class MagneticDipole(Force):
    r"""Two magnetic dipoles along the tip's axis: one in the middle of its sphere, one in the sample.

    .. math:: F = -\frac{3 \mu_0 m_t m_s}{2 \pi (d + R + s)^4} \quad (d > a_0)

    and its value at :math:`a_0` in contact; :math:`s` is the depth of the sample's dipole. Moments of equal sign are parallel
    and attract. The force is the slope of the dipole–dipole energy :math:`-\mu_0 m_t m_s / 2\pi r^3`, checked numerically.
    Valid for magnets small relative to their distance, with fixed moments.
    """

    name = "magnetic_dipole"
    title = "Magnetic dipoles"
    also_called = ("MFM", "magnetic force")
    contains = ("magnetic",)
    source = "J. D. Jackson, Classical Electrodynamics, Wiley (1999), section 5.7; derived again here"

    radius: float = shared("tip.radius")
    a0: float = shared("contact.a0")
    tip_moment: Number = param(
        "2e-18 A m^2", symbol="m_t", doc="magnetic moment of the tip, positive when it points up"
    )
    sample_moment: Number = param(
        "2e-18 A m^2", symbol="m_s", doc="magnetic moment in the sample, positive when it points up"
    )
    depth: Number = param("10 nm", low="0 nm", symbol="s", doc="depth of the sample's dipole below the surface")

    @property
    def strength(self) -> float:
        """Force times the fourth power of the dipoles' distance (N m^4)."""
        return -1.5 * MU_0 / pi * self.tip_moment * self.sample_moment

    @property
    def offset(self) -> float:
        """Distance of the dipoles when tip and surface touch at d = 0 (m)."""
        return self.radius + self.depth

    @property
    def contact_force(self) -> float:
        """Force in contact (N)."""
        return self.strength / (self.a0 + self.offset) ** 4

    @staticmethod
    def law(d: float, rate: float, t: float, strength: float, offset: float, a0: float, contact_force: float) -> float:
        square = (d + offset) * (d + offset)
        return strength / (square * square) if d > a0 else contact_force

    @staticmethod
    def potential(d: float, strength: float, offset: float, a0: float, contact_force: float) -> float:
        place = d if d > a0 else a0
        distance = place + offset
        return strength / distance**3 * (1.0 / 3.0 - (d - place) / distance)

    def kinks(self) -> tuple[float, ...]:
        return (self.a0,)
