"""Adhesive contacts with two branches: the tip snaps into contact, and comes off at a larger distance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from dforce.core.parameters import Number, param, shared
from dforce.forces._contract import OF_ADHESION, Force


class AdhesiveContact(Force):
    """The common part of adhesive contacts with a pull-off: tip, surface energy, and the ends of the branches."""

    contains = ("van der Waals", "elastic contact")
    dissipative = True
    example: ClassVar[Mapping[str, Any]] = {"surface_energy": "50 mJ/m^2"}
    hints: ClassVar[Mapping[str, str]] = OF_ADHESION

    radius: float = shared("tip.radius")
    E_eff: float = shared("contact.E_eff")
    a0: float = shared("contact.a0")
    surface_energy: Number = param(
        unit="J/m^2", above="0 J/m^2", symbol=r"\gamma", doc="surface energy, half the work of adhesion"
    )

    @property
    def gamma(self) -> float:
        """Surface energy (J/m^2)."""
        return self.surface_energy

    def ends(self, pull_off: float, limit: float) -> tuple[float, ...]:
        """Return the distances (m) at which contact begins and ends, and the one within which the attraction is limited.

        Parameters
        ----------
        pull_off
            Indentation (m) at which the tip comes off, negative.
        limit
            Distance (m) at which the attraction reaches its limit; left out within contact.
        """
        both = (self.a0, self.a0 - pull_off)
        return (*both, limit) if limit > self.a0 else both
