"""Lennard-Jones interaction of a sphere with a flat sample."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import Any, ClassVar

from dforce.core.parameters import Number, param, shared
from dforce.forces._contract import Force

CLOSEST = 0.25  # of z0: nearer, the repulsion is 4000 times the adhesion and no tip ever comes there


class LennardJones(Force):
    r"""Attraction and steep repulsion of a spherical tip and a flat sample of Lennard-Jones atoms.

    .. math:: F = -\frac{8 \pi R W}{3} \left[\left(\frac{z_0}{d}\right)^2
        - \frac{1}{4}\left(\frac{z_0}{d}\right)^8\right]

    with the largest attraction :math:`2\pi R W` at :math:`d = z_0`; far away it is `van_der_waals` with
    :math:`H = 16 \pi W z_0^2`. The bodies are rigid: the force follows from Derjaguin's approximation with the pressure
    :math:`\tfrac{8W}{3z_0}[(z_0/d)^3 - (z_0/d)^9]`. It includes the repulsion in contact. Valid for :math:`R \gg z_0` and stiff
    bodies; nearer than a quarter of :math:`z_0` the force is constant.
    """

    name = "lennard_jones"
    title = "Lennard-Jones"
    also_called = ("12-6", "6-12", "L-J")
    contains = ("van der Waals", "elastic contact")
    source = "J. N. Israelachvili, Intermolecular and Surface Forces, Academic Press (2011); integrated here"
    example: ClassVar[Mapping[str, Any]] = {"work_of_adhesion": "50 mJ/m^2"}

    radius: float = shared("tip.radius")
    work_of_adhesion: Number = param(
        unit="J/m^2", low="0 J/m^2", symbol="W", doc="work of adhesion, energy per area at the equilibrium distance"
    )
    equilibrium: Number = param(
        "0.165 nm", above="0 nm", symbol="z_0", doc="distance at which flat surfaces neither attract nor repel"
    )

    @property
    def strength(self) -> float:
        """Constant before the brackets (N)."""
        return 8.0 / 3.0 * pi * self.radius * self.work_of_adhesion

    @staticmethod
    def law(d: float, rate: float, t: float, strength: float, equilibrium: float) -> float:
        near = CLOSEST * equilibrium
        x = equilibrium / (d if d > near else near)
        square = x * x
        return -strength * square * (1.0 - 0.25 * square * square * square)

    @staticmethod
    def potential(d: float, strength: float, equilibrium: float) -> float:
        near = CLOSEST * equilibrium
        place = d if d > near else near
        x = equilibrium / place
        square = x * x
        energy = -strength * equilibrium * x * (1.0 - square * square * square / 28.0)
        return energy + strength * square * (1.0 - 0.25 * square * square * square) * (d - place)

    def kinks(self) -> tuple[float, ...]:
        return (CLOSEST * self.equilibrium,)
