"""Adhesion that is stronger while the tip withdraws."""

from __future__ import annotations

from math import pi

from dforce.core.errors import ParameterError
from dforce.core.parameters import MaybeNumber, Number, param, shared
from dforce.forces._contract import Force


class AdhesionHysteresis(Force):
    r"""Attraction with one surface energy on approach and a larger one on retract.

    .. math:: F = \begin{cases} -4 \pi R \gamma & d \le a_0 \\
        -4 \pi R \gamma\, a_0^2 / d^2 & d > a_0 \end{cases}
        \qquad \gamma = \gamma_a \ (\dot d < 0), \quad \gamma_r \ (\dot d > 0)

    Per cycle the sample dissipates :math:`4\pi R (\gamma_r - \gamma_a)\,\delta_\mathrm{max}` in contact, and :math:`4\pi R
    (\gamma_r - \gamma_a)\, a_0^2 (1/a_0 - 1/d_\mathrm{max})` outside. With a Hamaker constant the attraction outside is
    :math:`-H R/6 d^2` both ways, without loss, and the force may jump at :math:`a_0`. Add an elastic contact (`hertz`). The
    force jumps at the turning points of the motion. Valid if the turning points belong to the tap, not to noise.
    """

    name = "adhesion_hysteresis"
    title = "Adhesion hysteresis"
    also_called = ("surface energy hysteresis", "adhesive hysteresis")
    contains = ("van der Waals",)
    dissipative = True
    source = "R. García, C. J. Gómez, N. F. Martínez et al., Phys. Rev. Lett. 97, 016103 (2006)"

    radius: float = shared("tip.radius")
    a0: float = shared("contact.a0")
    approach_energy: Number = param("20 mJ/m^2", low="0 J/m^2", symbol=r"\gamma_a", doc="surface energy on approach")
    retract_energy: Number = param("30 mJ/m^2", low="0 J/m^2", symbol=r"\gamma_r", doc="surface energy on retract")
    hamaker: MaybeNumber = param(
        None,
        unit="J",
        low="0 J",
        symbol="H",
        doc="Hamaker constant outside contact; default: from the surface energy of each direction",
    )

    def check_bound(self) -> None:
        if self.retract_energy < self.approach_energy:
            raise ParameterError(
                f"adhesion_hysteresis.retract_energy = {self.retract_energy:g} J/m^2 is below "
                f"approach_energy = {self.approach_energy:g} J/m^2, so the sample would add energy"
            )

    @property
    def approach_adhesion(self) -> float:
        """Adhesion in contact on approach (N)."""
        return 4.0 * pi * self.radius * self.approach_energy

    @property
    def retract_adhesion(self) -> float:
        """Adhesion in contact on retract (N)."""
        return 4.0 * pi * self.radius * self.retract_energy

    @property
    def approach_attraction(self) -> float:
        """Attraction outside times the distance squared, on approach (N m^2)."""
        if self.hamaker is not None:
            return self.hamaker * self.radius / 6.0
        return self.approach_adhesion * self.a0**2

    @property
    def retract_attraction(self) -> float:
        """Attraction outside times the distance squared, on retract (N m^2)."""
        if self.hamaker is not None:
            return self.hamaker * self.radius / 6.0
        return self.retract_adhesion * self.a0**2

    @staticmethod
    def law(
        d: float,
        rate: float,
        t: float,
        latched: float,
        approach_adhesion: float,
        retract_adhesion: float,
        approach_attraction: float,
        retract_attraction: float,
        a0: float,
    ) -> float:
        if d > a0:
            return -(retract_attraction if latched > 0.5 else approach_attraction) / (d * d)
        return -retract_adhesion if latched > 0.5 else -approach_adhesion

    @staticmethod
    def switch(
        latched: float,
        d: float,
        rate: float,
        t: float,
        approach_adhesion: float,
        retract_adhesion: float,
        approach_attraction: float,
        retract_attraction: float,
        a0: float,
    ) -> float:
        return -rate if latched > 0.5 else rate

    def kinks(self) -> tuple[float, ...]:
        return (self.a0,)

    def jumps(self) -> tuple[float, ...]:
        pairs = ((self.approach_attraction, self.approach_adhesion), (self.retract_attraction, self.retract_adhesion))
        matched = all(abs(far / self.a0**2 - near) <= 1e-12 * near for far, near in pairs)
        return () if matched else (self.a0,)
