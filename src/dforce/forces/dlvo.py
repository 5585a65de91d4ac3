"""Double layer and van der Waals force in a salt solution."""

from __future__ import annotations

from collections.abc import Mapping
from math import asinh, pi, sqrt, tanh
from typing import Any, ClassVar, Literal, Self

import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import MaybeNumber, Number, param, shared
from dforce.forces._contract import Force
from dforce.forces._exponential import exponential

VACUUM_PERMITTIVITY = 8.8541878128e-12  # F/m, CODATA 2018
BOLTZMANN = 1.380649e-23  # J/K, exact
ELEMENTARY_CHARGE = 1.602176634e-19  # C, exact
AVOGADRO = 6.02214076e23  # 1/mol, exact


class DLVO(Force):
    r"""Derjaguin–Landau–Verwey–Overbeek force between a sphere and a flat sample in a 1:1 salt solution.

    .. math:: F = \frac{4 \pi R \lambda}{\varepsilon \varepsilon_0} \sigma_t \sigma_s e^{-d/\lambda}
        - \frac{H R}{6 d^2} \quad (d > a_0)

    and its value at :math:`a_0` in contact. The first term superposes the potentials of the two surfaces;
    other forms of it, with :math:`x = d/\lambda` and :math:`P = 2 \pi R \lambda /
    \varepsilon\varepsilon_0`:

    - `constant_charge`, to second order:
      :math:`P [2\sigma_t\sigma_s e^{-x} + (\sigma_t^2 + \sigma_s^2) e^{-2x}]`
    - `constant_charge_exact`, of the linear Poisson–Boltzmann equation: the same over :math:`1 - e^{-2x}`
    - `constant_potential`, to second order:
      :math:`P [2\sigma_t\sigma_s e^{-x} - (\sigma_t^2 + \sigma_s^2) e^{-2x}]` with :math:`\sigma =
      \varepsilon\varepsilon_0\psi/\lambda`
    - `gouy_chapman`, superposed, for potentials that are not small:
      :math:`128 \pi R k_B T n_\infty \lambda \tanh\frac{e\psi_t}{4 k_B T} \tanh\frac{e\psi_s}{4 k_B T}\,
      e^{-x}`

    Each surface has a charge density or a potential, converted by :math:`\sigma = \varepsilon\varepsilon_0\psi/\lambda`, for
    `gouy_chapman` by Grahame's equation. Set the Debye length or the salt concentration, :math:`\lambda =
    \sqrt{\varepsilon\varepsilon_0 k_B T / 2 e^2 n_\infty}`. Valid for :math:`R \gg \lambda` and potentials below 25 mV (except
    `gouy_chapman`).
    """

    name = "dlvo"
    also_called = (
        "EDL",
        "double layer",
        "electrical double layer",
        "electric double layer",
        "Debye",
        "Debye-Hückel",
        "Poisson-Boltzmann",
        "screened electrostatic",
    )
    contains = ("double layer", "van der Waals")
    source = (
        "J. N. Israelachvili, Intermolecular and Surface Forces, Academic Press (2011); "
        "R. Hogg, T. W. Healy, D. W. Fuerstenau, Trans. Faraday Soc. 62, 1638 (1966)"
    )
    example: ClassVar[Mapping[str, Any]] = {
        "hamaker": "1e-20 J",
        "debye_length": "1 nm",
        "tip_charge": "-32 mC/m^2",
        "sample_charge": "-50 mC/m^2",
    }

    radius: float = shared("tip.radius")
    a0: float = shared("contact.a0")
    permittivity: float = shared("medium.permittivity")
    temperature: float = shared("medium.temperature")
    hamaker: Number = param(unit="J", symbol="H", doc="Hamaker constant across the liquid")
    tip_charge: MaybeNumber = param(None, unit="C/m^2", symbol=r"\sigma_t", doc="charge density of the tip")
    sample_charge: MaybeNumber = param(None, unit="C/m^2", symbol=r"\sigma_s", doc="charge density of the sample")
    tip_potential: MaybeNumber = param(None, unit="V", symbol=r"\psi_t", doc="surface potential of the tip")
    sample_potential: MaybeNumber = param(None, unit="V", symbol=r"\psi_s", doc="surface potential of the sample")
    debye_length: MaybeNumber = param(
        None, unit="m", above="0 nm", symbol=r"\lambda", doc="Debye length; default: from the salt"
    )
    salt: MaybeNumber = param(
        None, unit="mol/m^3", above="0 mol/m^3", symbol="c", doc="concentration of the 1:1 salt; or the Debye length"
    )
    variant: Literal[
        "superposition", "constant_charge", "constant_charge_exact", "constant_potential", "gouy_chapman"
    ] = pydantic.Field("superposition", description="form of the double layer force")

    @pydantic.model_validator(mode="after")
    def _each_is_given_once(self) -> Self:
        for one, other in (
            ("tip_charge", "tip_potential"),
            ("sample_charge", "sample_potential"),
            ("debye_length", "salt"),
        ):
            given = [name for name in (one, other) if getattr(self, name) is not None]
            if len(given) != 1:
                raise ParameterError(f"dlvo needs one of {one} and {other}, but has {'both' if given else 'none'}")
        return self

    @property
    def screening(self) -> float:
        """Debye length, given or from the salt concentration (m)."""
        if self.debye_length is not None:
            return self.debye_length
        ions = self.needed("salt") * AVOGADRO
        thermal = BOLTZMANN * self.temperature
        return sqrt(self.permittivity * VACUUM_PERMITTIVITY * thermal / (2.0 * ELEMENTARY_CHARGE**2 * ions))

    def charge(self, surface: str) -> float:
        """Return the charge density of the tip or the sample, from its potential if need be (C/m^2)."""
        given = getattr(self, f"{surface}_charge")
        if given is not None:
            return float(given)
        return self.permittivity * VACUUM_PERMITTIVITY / self.screening * self.needed(f"{surface}_potential")

    def reduced_potential(self, surface: str) -> float:
        """Return tanh(e psi / 4 kT) of a surface, from its charge by Grahame's equation if need be."""
        thermal = BOLTZMANN * self.temperature
        given = getattr(self, f"{surface}_potential")
        if given is None:
            # 8 eps eps0 n kT with n from the Debye length
            scale = 2.0 * self.permittivity * VACUUM_PERMITTIVITY * thermal / (ELEMENTARY_CHARGE * self.screening)
            return tanh(0.5 * asinh(self.needed(f"{surface}_charge") / scale))
        return tanh(ELEMENTARY_CHARGE * given / (4.0 * thermal))

    @property
    def first(self) -> float:
        """Force that decays with the Debye length, extrapolated to zero distance (N)."""
        if self.variant == "gouy_chapman":
            # n kT = eps eps0 (kT/e)^2 / 2 lambda^2
            thermal_voltage = BOLTZMANN * self.temperature / ELEMENTARY_CHARGE
            pressure = 0.5 * self.permittivity * VACUUM_PERMITTIVITY * (thermal_voltage / self.screening) ** 2
            potentials = self.reduced_potential("tip") * self.reduced_potential("sample")
            return 128.0 * pi * self.radius * pressure * self.screening * potentials
        return 2.0 * self._prefactor * self.charge("tip") * self.charge("sample")

    @property
    def second(self) -> float:
        """Force that decays with half the Debye length, extrapolated to zero distance (N)."""
        if self.variant in ("superposition", "gouy_chapman"):
            return 0.0
        sign = -1.0 if self.variant == "constant_potential" else 1.0
        return sign * self._prefactor * (self.charge("tip") ** 2 + self.charge("sample") ** 2)

    @property
    def _prefactor(self) -> float:
        return 2.0 * pi * self.radius * self.screening / (self.permittivity * VACUUM_PERMITTIVITY)

    @property
    def divided(self) -> float:
        """One where both terms are divided by 1 - exp(-2 d/lambda), else zero (1)."""
        return 1.0 if self.variant == "constant_charge_exact" else 0.0

    @property
    def attraction(self) -> float:
        """Van der Waals attraction times the distance squared, HR/6 (N m^2)."""
        return self.hamaker * self.radius / 6.0

    @property
    def decay(self) -> float:
        """Inverse of the Debye length (1/m)."""
        return 1.0 / self.screening

    @property
    def contact_force(self) -> float:
        """Force in contact (N)."""
        return dlvo_force(self.a0, self.first, self.second, self.divided, self.decay, self.attraction)

    @staticmethod
    def law(
        d: float,
        rate: float,
        t: float,
        first: float,
        second: float,
        divided: float,
        decay: float,
        attraction: float,
        a0: float,
        contact_force: float,
    ) -> float:
        return dlvo_force(d, first, second, divided, decay, attraction) if d > a0 else contact_force

    def kinks(self) -> tuple[float, ...]:
        return (self.a0,)


def dlvo_force(d: float, first: float, second: float, divided: float, decay: float, attraction: float) -> float:
    """Return the force (N) outside contact."""
    x = exponential(-decay * d)
    return x * (first + second * x) / (1.0 - divided * x * x) - attraction / (d * d)
