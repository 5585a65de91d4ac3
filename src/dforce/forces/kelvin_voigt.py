"""Viscous drag over the contact area."""

from __future__ import annotations

from math import pi, sqrt, tan
from typing import Literal

import pydantic

from dforce.core.parameters import Number, param, shared
from dforce.forces._contract import Force


class KelvinVoigt(Force):
    r"""Viscous drag over the contact area, beside an elastic contact (`hertz`, `dmt`, `sneddon`, ...).

    .. math:: F = \eta\, a(\delta)\, \dot\delta = -\eta\, a(a_0 - d)\, \dot d \quad\text{in contact},
        \qquad a = \sqrt{R \delta}\ \text{(sphere)}

    with the contact radius :math:`a` of the tip's shape: :math:`\tfrac{2}{\pi}\tan\theta\,\delta` for a
    cone, :math:`\tan\theta\,\delta/\sqrt{2}` for a four-sided pyramid (a punch with equal stiffness), and :math:`R` for a
    punch. A Kelvin–Voigt solid, :math:`F = \eta^* \tfrac{d}{dt}(F_\mathrm{el}/E_\mathrm{eff})`, gives this force with
    :math:`\eta = 2\eta^*` for each of these shapes, because :math:`dF_\mathrm{el}/d\delta = 2 E_\mathrm{eff}\, a`.

    While the tip withdraws the drag pulls, and elastic and viscous force together may be attractive. With
    `no_tension` the drag never exceeds the elastic force of the same shape, so that their sum is never
    attractive: right for a surface without adhesion. Valid for samples that recover fully between taps.
    """

    name = "kelvin_voigt"
    title = "Kelvin–Voigt"
    also_called = ("Voigt", "viscous contact", "dashpot", "viscosity", "damper")
    contains = ("contact viscosity",)
    dissipative = True
    source = (
        "R. García, A. San Paulo, Phys. Rev. B 60, 4961 (1999); the shapes derived here from I. N. Sneddon, "
        "Int. J. Eng. Sci. 3, 47 (1965)"
    )

    radius: float | None = shared("tip.radius")
    half_angle: float | None = shared("tip.half_angle")
    E_eff: float | None = shared("contact.E_eff")
    a0: float = shared("contact.a0")
    viscosity: Number = param(
        "100 Pa s",
        symbol=r"\eta",
        low="0 Pa s",
        doc="viscosity coefficient of the contact, twice the plane-strain viscosity",
    )
    geometry: Literal["sphere", "cone", "pyramid", "punch"] = pydantic.Field("sphere", description="shape of the tip")
    no_tension: bool = pydantic.Field(
        False, description="limit the drag on withdrawal to the elastic force, for surfaces that do not stick"
    )

    @property
    def flat(self) -> float:
        """Contact radius of a flat punch, else 0 (m)."""
        return self.needed("radius") if self.geometry == "punch" else 0.0

    @property
    def blunt(self) -> float:
        """Contact radius of a sphere per square root of the indentation, else 0 (m^0.5)."""
        return sqrt(self.needed("radius")) if self.geometry == "sphere" else 0.0

    @property
    def slope(self) -> float:
        """Contact radius of a cone or pyramid per indentation, else 0 (1)."""
        if self.geometry not in ("cone", "pyramid"):
            return 0.0
        return tan(self.needed("half_angle")) * (2.0 / pi if self.geometry == "cone" else sqrt(0.5))

    @property
    def clip_modulus(self) -> float:
        """Twice the effective modulus where the drag is limited, -1 where it is not (Pa)."""
        return 2.0 * self.needed("E_eff") if self.no_tension else -1.0

    @staticmethod
    def law(
        d: float,
        rate: float,
        t: float,
        viscosity: float,
        flat: float,
        blunt: float,
        slope: float,
        clip_modulus: float,
        a0: float,
    ) -> float:
        depth = a0 - d
        if depth <= 0.0:
            return 0.0
        square_root = sqrt(depth)
        drag = -viscosity * (flat + blunt * square_root + slope * depth) * rate
        if clip_modulus >= 0.0:
            elastic = clip_modulus * depth * (flat + 2.0 / 3.0 * blunt * square_root + 0.5 * slope * depth)
            return drag if drag > -elastic else -elastic
        return drag

    @property
    def is_rooted(self) -> bool:
        """Whether the contact radius grows like a root, with and without viscosity; the compiled code depends on it."""
        return self.geometry == "sphere"

    def kinks(self) -> tuple[float, ...]:
        return (self.a0,)

    def jumps(self) -> tuple[float, ...]:
        return (self.a0,) if self.geometry == "punch" else ()
