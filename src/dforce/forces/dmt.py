"""Elastic contact with van der Waals attraction outside and constant adhesion inside."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi, sqrt
from typing import Any, ClassVar, Self

import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import MaybeNumber, param, shared
from dforce.forces._contract import OF_ADHESION, Force
from dforce.forces.hertz import Hertz
from dforce.forces.van_der_waals import VanDerWaals


class DMT(Force):
    r"""Derjaguin–Muller–Toporov contact of a stiff sample: attraction outside, contact with adhesion inside.

    .. math::

        F = \begin{cases} -\dfrac{H R}{6 d^2} & d > a_0 \\[1ex]
        \tfrac{4}{3} E_\mathrm{eff} \sqrt{R}\, (a_0 - d)^{3/2} - 4 \pi R \gamma & d \le a_0 \end{cases}

    Set the Hamaker constant or the surface energy of one of two equal materials (work of adhesion :math:`W = 2\gamma`); the
    other follows from the continuity of the force, :math:`4 \pi R \gamma = H R / 6 a_0^2`. If you set both, the force jumps
    at :math:`a_0` unless they agree. The model equals `van_der_waals` plus `hertz`. Valid for small Tabor parameters,
    :math:`(R W^2 / E_\mathrm{eff}^2 a_0^3)^{1/3} < 0.1`, and indentations small relative to the tip radius.
    """

    name = "dmt"
    also_called = ("Derjaguin", "Derjaguin-Muller-Toporov", "adhesive contact")
    contains = ("van der Waals", "elastic contact")
    source = (
        "B. V. Derjaguin, V. M. Muller, Yu. P. Toporov, J. Colloid Interface Sci. 53, 314 (1975); "
        "R. García, A. San Paulo, Phys. Rev. B 60, 4961 (1999)"
    )
    example: ClassVar[Mapping[str, Any]] = {"hamaker": "1e-19 J"}

    radius: float = shared("tip.radius")
    E_eff: float = shared("contact.E_eff")
    a0: float = shared("contact.a0")
    hamaker: MaybeNumber = param(
        None, unit="J", low="0 J", symbol="H", doc="Hamaker constant; default: from the surface energy"
    )
    hints: ClassVar[Mapping[str, str]] = OF_ADHESION
    surface_energy: MaybeNumber = param(
        None,
        unit="J/m^2",
        low="0 J/m^2",
        symbol=r"\gamma",
        doc="surface energy, half the work of adhesion; default: from the Hamaker constant",
    )

    @pydantic.model_validator(mode="after")
    def _one_is_given(self) -> Self:
        if self.hamaker is None and self.surface_energy is None:
            raise ParameterError("dmt needs hamaker or surface_energy; write one of them")
        return self

    @property
    def stiffness(self) -> float:
        """Force per indentation to the power 3/2 (N/m^1.5)."""
        return 4.0 / 3.0 * self.E_eff * sqrt(self.radius)

    @property
    def H(self) -> float:
        """Hamaker constant, given or from the surface energy (J)."""
        if self.hamaker is not None:
            return self.hamaker
        return 24.0 * pi * self.a0**2 * self.needed("surface_energy")

    @property
    def gamma(self) -> float:
        """Surface energy, given or from the Hamaker constant (J/m^2)."""
        if self.surface_energy is not None:
            return self.surface_energy
        return self.needed("hamaker") / (24.0 * pi * self.a0**2)

    @property
    def attraction(self) -> float:
        """Attraction outside contact times the distance squared, HR/6 (N m^2)."""
        return self.H * self.radius / 6.0

    @property
    def adhesion(self) -> float:
        """Adhesion in contact (N)."""
        if self.surface_energy is None:
            return self.attraction / self.a0**2  # to the last digit, so that the law is continuous
        return 4.0 * pi * self.radius * self.gamma

    @staticmethod
    def law(d: float, rate: float, t: float, stiffness: float, attraction: float, adhesion: float, a0: float) -> float:
        depth = a0 - d
        return stiffness * depth * sqrt(depth) - adhesion if depth > 0.0 else -attraction / (d * d)

    @staticmethod
    def potential(d: float, stiffness: float, attraction: float, adhesion: float, a0: float) -> float:
        depth = a0 - d
        if depth > 0.0:
            return (0.4 * stiffness * depth * sqrt(depth) - adhesion) * depth - attraction / a0
        return -attraction / d

    def parts(self) -> tuple[Force, ...]:
        if self.jumps():  # the attraction in contact is not that at a0
            return (self,)
        attraction = VanDerWaals(hamaker=self.H).model_copy(update={"radius": self.radius, "a0": self.a0})
        contact = Hertz().model_copy(update={"radius": self.radius, "E_eff": self.E_eff, "a0": self.a0})
        return attraction, contact

    def kinks(self) -> tuple[float, ...]:
        return (self.a0,)

    def jumps(self) -> tuple[float, ...]:
        outside = self.attraction / self.a0**2
        return (self.a0,) if abs(self.adhesion - outside) > 1e-12 * outside else ()
