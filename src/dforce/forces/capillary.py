"""Water neck between tip and sample."""

from __future__ import annotations

from math import cos, log, pi, sqrt
from typing import Literal

import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import Number, param, shared
from dforce.forces._contract import Force

GAS_CONSTANT = 8.31446261815324  # J/(mol K), exact


class Capillary(Force):
    r"""Attraction by a liquid neck, which forms at a small distance and breaks at a larger distance.

    .. math:: F = -4 \pi R \gamma_L \cos\theta \left[1 - \frac{d}{\sqrt{d^2 + V/\pi R}}\right]
        \quad\text{(constant volume)}

    while the neck exists, and its value at :math:`a_0` in contact. The neck forms at the distance `formation` (for example,
    at the contact of two water films) and breaks at :math:`(1 + \theta/2) V^{1/3}`. Per cycle the sample dissipates the
    difference of :math:`4 \pi R \gamma_L \cos\theta\, [d - \sqrt{d^2 + V/\pi R}]` between these distances. A run starts
    without a neck. With `kelvin` the neck is in equilibrium with the vapor, with the radius of curvature
    :math:`r_K = \gamma_L V_m / (R_g T \ln(1/h))` at the relative humidity :math:`h`:

    .. math:: F = -4 \pi R \gamma_L \cos\theta \left[1 - \frac{d}{2 r_K \cos\theta}\right]

    until it breaks at :math:`2 r_K \cos\theta`, where its force is zero. Valid for necks small relative to the tip radius and
    liquids that wet both bodies equally.
    """

    name = "capillary"
    title = "Capillary neck"
    also_called = (
        "meniscus",
        "water bridge",
        "liquid bridge",
        "capillary bridge",
        "capillary condensation",
        "Kelvin radius",
    )
    contains = ("capillary neck",)
    dissipative = True
    source = (
        "L. Zitzler, S. Herminghaus, F. Mugele, Phys. Rev. B 66, 155436 (2002); "
        "J. N. Israelachvili, Intermolecular and Surface Forces, Academic Press (2011) for kelvin"
    )

    radius: float = shared("tip.radius")
    temperature: float | None = shared("medium.temperature")
    a0: float = shared("contact.a0")
    surface_tension: Number = param("72 mJ/m^2", low="0 J/m^2", symbol=r"\gamma_L", doc="surface tension of the liquid")
    contact_angle: Number = param(
        "0 deg", low="0 deg", below="90 deg", symbol=r"\theta", doc="contact angle of the liquid on both bodies"
    )
    formation: Number = param(
        "0.5 nm", low="0 nm", symbol=r"d_\mathrm{on}", doc="distance at which the neck forms on approach"
    )
    meniscus: Literal["constant_volume", "kelvin"] = pydantic.Field(
        "constant_volume", description="quantity that a stretched neck keeps constant"
    )
    volume: Number = param("10 nm^3", above="0 nm^3", symbol="V", doc="volume of the neck (constant_volume)")
    humidity: Number = param("0.5", above="0", below="1", symbol="h", doc="relative humidity (kelvin)")
    molar_volume: Number = param(
        "1.8e-5 m^3/mol", above="0 m^3/mol", symbol="V_m", doc="molar volume of the liquid (kelvin)"
    )

    def check_bound(self) -> None:
        if self.formation >= self.rupture:
            raise ParameterError(
                f"capillary.formation = {self.formation:g} m is not below the distance at which the neck "
                f"breaks, {self.rupture:g} m"
            )
        super().check_bound()

    @property
    def strength(self) -> float:
        """Attraction at zero distance (N)."""
        return 4.0 * pi * self.radius * self.surface_tension * cos(self.contact_angle)

    @property
    def spread(self) -> float:
        """Volume over pi R of a neck of constant volume; 0 with kelvin (m^2)."""
        return self.volume / (pi * self.radius) if self.meniscus == "constant_volume" else 0.0

    @property
    def rupture(self) -> float:
        """Distance at which the neck breaks (m)."""
        if self.meniscus == "constant_volume":
            return float((1.0 + 0.5 * self.contact_angle) * self.volume ** (1.0 / 3.0))
        thermal = GAS_CONSTANT * self.needed("temperature") * log(1.0 / self.humidity)
        return 2.0 * self.surface_tension * self.molar_volume / thermal * cos(self.contact_angle)

    @staticmethod
    def law(
        d: float,
        rate: float,
        t: float,
        latched: float,
        strength: float,
        spread: float,
        formation: float,
        rupture: float,
        a0: float,
    ) -> float:
        if latched < 0.5:
            return 0.0
        near = d if d > a0 else a0
        if near > rupture:
            near = rupture  # a solver may look a little beyond the place where it lets the neck break
        if spread > 0.0:
            return -strength * (1.0 - near / sqrt(near * near + spread))
        return -strength * (1.0 - near / rupture)

    @staticmethod
    def switch(
        latched: float,
        d: float,
        rate: float,
        t: float,
        strength: float,
        spread: float,
        formation: float,
        rupture: float,
        a0: float,
    ) -> float:
        return d - rupture if latched > 0.5 else formation - d

    def kinks(self) -> tuple[float, ...]:
        return (self.a0, self.rupture)
