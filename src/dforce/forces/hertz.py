"""Elastic contact of a sphere with a flat sample."""

from __future__ import annotations

from math import sqrt

from dforce.core.parameters import shared
from dforce.forces._contract import Force


class Hertz(Force):
    r"""Elastic contact of a spherical tip with a flat, thick, elastic sample.

    .. math:: F = \tfrac{4}{3} E_\mathrm{eff} \sqrt{R}\, \delta^{3/2}, \qquad \delta = a_0 - d > 0

    and no force outside contact. Valid for indentations small relative to the tip radius and no adhesion.
    """

    name = "hertz"
    also_called = ("Hertzian", "sphere contact", "elastic sphere")
    contains = ("elastic contact",)
    source = "H. Hertz, J. reine angew. Math. 92, 156 (1881); R. García, Amplitude Modulation AFM, Wiley (2010)"

    radius: float = shared("tip.radius")
    E_eff: float = shared("contact.E_eff")
    a0: float = shared("contact.a0")

    @property
    def stiffness(self) -> float:
        """Force per indentation to the power 3/2 (N/m^1.5)."""
        return 4.0 / 3.0 * self.E_eff * sqrt(self.radius)

    @staticmethod
    def law(d: float, rate: float, t: float, stiffness: float, a0: float) -> float:
        depth = a0 - d
        return stiffness * depth * sqrt(depth) if depth > 0.0 else 0.0

    @staticmethod
    def potential(d: float, stiffness: float, a0: float) -> float:
        depth = a0 - d
        return 0.4 * stiffness * depth * depth * sqrt(depth) if depth > 0.0 else 0.0

    def kinks(self) -> tuple[float, ...]:
        return (self.a0,)
