"""Repulsion of bound water."""

from __future__ import annotations

from math import exp, pi

from dforce.core.parameters import Number, param, shared
from dforce.forces._contract import Force
from dforce.forces._exponential import PER_E, raised


class Hydration(Force):
    r"""Repulsion by bound water on hydrophilic surfaces.

    .. math:: F = 2 \pi R W_h\, e^{-d/\lambda_h} \quad (d > a_0)

    and its value at :math:`a_0` in contact: Derjaguin's approximation for a sphere with the energy per area :math:`W_h
    e^{-d/\lambda_h}`. A negative :math:`W_h` is the attraction of hydrophobic surfaces. Valid for :math:`R \gg \lambda_h`.
    """

    name = "hydration"
    also_called = ("hydrophobic", "hydrophilic", "structural repulsion", "water layer")
    contains = ("hydration",)
    source = "J. N. Israelachvili, Intermolecular and Surface Forces, Academic Press (2011)"

    radius: float = shared("tip.radius")
    a0: float = shared("contact.a0")
    energy: Number = param("5 mJ/m^2", symbol="W_h", doc="energy per area, extrapolated to zero distance")
    decay: Number = param("0.5 nm", above="0 nm", symbol=r"\lambda_h", doc="decay length")

    @property
    def strength(self) -> float:
        """Force extrapolated to zero distance (N)."""
        return 2.0 * pi * self.radius * self.energy

    @property
    def steepness(self) -> float:
        """Inverse of the decay length, in steps of the exponential (1/m)."""
        return PER_E / self.decay

    @property
    def contact_force(self) -> float:
        """Force in contact (N)."""
        return self.strength * exp(-self.a0 / self.decay)

    @staticmethod
    def law(
        d: float, rate: float, t: float, strength: float, steepness: float, a0: float, contact_force: float
    ) -> float:
        return raised(-steepness * d, strength) if d > a0 else contact_force

    @staticmethod
    def potential(d: float, strength: float, steepness: float, a0: float, contact_force: float) -> float:
        decay = PER_E / steepness
        return raised(-steepness * d, strength * decay) if d > a0 else contact_force * (decay + a0 - d)

    def kinks(self) -> tuple[float, ...]:
        return (self.a0,)
