"""A polymer brush on the sample, as a force model of dForce."""

from math import exp, pi

import dforce as df


class Brush(df.Force):
    r"""Repulsion of a polymer brush that a sphere presses upon.

    .. math:: F = 2 \pi R\, w\, e^{-d/L}

    and its value at :math:`a_0` in contact. Valid for :math:`R \gg L`.
    """

    name = "brush"
    source = "exponential form of the Alexander-de Gennes theory of brushes"

    energy: float = df.param("3 mJ/m^2", symbol="w", low="0 J/m^2", doc="energy per area at the surface")
    length: float = df.param("4 nm", symbol="L", above="0 nm", doc="length over which the force decays")
    radius: float = df.shared("tip.radius")
    a0: float = df.shared("contact.a0")

    @staticmethod
    def law(d, rate, t, energy, length, radius, a0):
        return 2.0 * pi * radius * energy * exp(-max(d, a0) / length)

    def kinks(self):
        return (self.a0,)
