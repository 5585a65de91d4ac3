"""Morse interaction: a short-range chemical bond."""

from __future__ import annotations

from math import exp

from dforce.core.parameters import Number, param
from dforce.forces._contract import Force
from dforce.forces._exponential import exponential


class Morse(Force):
    r"""Bond between the last atom of the tip and the atom below it.

    .. math:: F = 2 \kappa E_b \left[e^{-2\kappa(d - \sigma)} - e^{-\kappa(d - \sigma)}\right]

    with no force at :math:`d = \sigma` and the largest attraction :math:`\kappa E_b / 2` at :math:`\sigma
    + \ln 2/\kappa`. For atomically sharp tips at distances of a bond length; below :math:`d = 0` the force is constant.
    """

    name = "morse"
    also_called = ("chemical bond", "covalent bond", "short-range bond")
    contains = ("chemical bond",)
    source = "P. M. Morse, Phys. Rev. 34, 57 (1929); R. Pérez et al., Phys. Rev. B 58, 10835 (1998)"

    bond_energy: Number = param("2.15e-19 J", low="0 J", symbol="E_b", doc="depth of the bond's energy")
    decay: Number = param("15.5 1/nm", above="0 1/nm", symbol=r"\kappa", doc="inverse decay length of the attraction")
    bond_length: Number = param(
        "0.2357 nm", low="0 nm", high="10 nm", symbol=r"\sigma", doc="distance at which the force is zero"
    )

    @staticmethod
    def law(d: float, rate: float, t: float, bond_energy: float, decay: float, bond_length: float) -> float:
        x = exponential(-decay * ((d if d > 0.0 else 0.0) - bond_length))
        return 2.0 * decay * bond_energy * x * (x - 1.0)

    @staticmethod
    def potential(d: float, bond_energy: float, decay: float, bond_length: float) -> float:
        place = d if d > 0.0 else 0.0
        x = exp(-decay * (place - bond_length))
        return bond_energy * x * (x - 2.0 - 2.0 * decay * (x - 1.0) * (d - place))

    def kinks(self) -> tuple[float, ...]:
        return (0.0,)
