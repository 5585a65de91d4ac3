"""Electrostatic attraction of a biased tip."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, exp, log, pi, sin, tan
from typing import Literal

import pydantic

from dforce.core.parameters import Number, param, shared
from dforce.forces._contract import Force

VACUUM_PERMITTIVITY = 8.8541878128e-12  # F/m, CODATA 2018


class Electrostatic(Force):
    r"""Attraction between a conducting tip and a conducting flat sample at different potentials.

    .. math:: F = -\frac{\pi \varepsilon_0 R^2 V^2}{d (d + R)} \quad\text{(sphere)}, \qquad
        V = V_\mathrm{dc} - V_\mathrm{cpd} + V_\mathrm{ac} \cos 2\pi f t

    and its value at :math:`a_0` in contact. With `sphere_and_cone` the tip is the end of the sphere with a cone above it, of
    half-angle :math:`\theta` and height :math:`H_c`; with :math:`D = d + R(1 - \sin\theta)`:

    .. math:: F = -\pi \varepsilon_0 V^2 \left[\frac{R^2 (1 - \sin\theta)}{d\, D}
        + \frac{1}{(\ln\tan\frac{\theta}{2})^2} \left(\ln\frac{H_c}{D} - 1
        + \frac{R \cos^2\theta}{D \sin\theta}\right)\right]

    The term of the cone is zero where it would repel. Checked for dForce: the sphere is within 6 % of the exact
    series of a sphere and a plane at every distance, and exact at both ends. The term of the cone follows from the field
    :math:`V / (z \tan\theta\, |\ln\tan\frac{\theta}{2}|)` on the cone at the height :math:`z`, integrated from D to :math:`H_c
    \gg R`. Valid in gas and vacuum, without the attraction of the lever.
    """

    name = "electrostatic"
    also_called = ("KPFM", "Kelvin probe", "contact potential difference", "CPD", "Coulomb", "EFM")
    contains = ("electrostatic bias",)
    source = "S. Hudlet, M. Saint Jean, C. Guthmann, J. Berger, Eur. Phys. J. B 2, 5 (1998)"

    radius: float = shared("tip.radius")
    half_angle: float | None = shared("tip.half_angle")
    a0: float = shared("contact.a0")
    bias: Number = param("1 V", symbol=r"V_\mathrm{dc}", doc="constant voltage between tip and sample")
    contact_potential: Number = param(
        "0 V", symbol=r"V_\mathrm{cpd}", doc="contact potential difference, the bias without force"
    )
    ac_bias: Number = param("0 V", symbol=r"V_\mathrm{ac}", doc="amplitude of the alternating voltage")
    ac_frequency: Number = param("1 kHz", low="0 Hz", symbol="f", doc="frequency of the alternating voltage")
    cone_height: Number = param("10 um", above="0 um", symbol="H_c", doc="height of the cone")
    geometry: Literal["sphere", "sphere_and_cone"] = pydantic.Field("sphere", description="attracting parts of the tip")

    @property
    def timed(self) -> bool:  # type: ignore[override]
        """Whether the force depends on time."""
        return self.ac_bias != 0.0

    @property
    def own_frequency(self) -> float | None:
        """Frequency (Hz) of the alternating voltage."""
        return self.ac_frequency if self.timed else None

    @property
    def strength(self) -> float:
        """Force of the sphere per squared voltage, times distances (N m^2/V^2)."""
        angle_part = 1.0 - sin(self.needed("half_angle")) if self.geometry == "sphere_and_cone" else 1.0
        return pi * VACUUM_PERMITTIVITY * self.radius**2 * angle_part

    @property
    def offset(self) -> float:
        """Height of the point where the cone begins; R for a sphere alone (m)."""
        if self.geometry == "sphere":
            return self.radius
        return self.radius * (1.0 - sin(self.needed("half_angle")))

    @property
    def cone(self) -> float:
        """Force of the cone per squared voltage and unit of its bracket; 0 without a cone (N/V^2)."""
        if self.geometry == "sphere":
            return 0.0
        return pi * VACUUM_PERMITTIVITY / log(tan(0.5 * self.needed("half_angle"))) ** 2

    @property
    def join(self) -> float:
        """Length in the last term of the cone, R cos²(theta)/sin(theta) (m)."""
        if self.geometry == "sphere":
            return 0.0
        angle = self.needed("half_angle")
        return self.radius * cos(angle) ** 2 / sin(angle)

    @property
    def steady(self) -> float:
        """Constant part of the voltage (V)."""
        return self.bias - self.contact_potential

    @property
    def omega(self) -> float:
        """Angular frequency of the alternating voltage (rad/s)."""
        return 2.0 * pi * self.ac_frequency

    @property
    def steady_strength(self) -> float:
        """Force of the sphere at the constant voltage, times distances (N m^2)."""
        return -self.strength * self.steady**2

    @property
    def contact_force(self) -> float:
        """Force of the sphere in contact at the constant voltage (N)."""
        return self.steady_strength / (self.a0 * (self.a0 + self.offset))

    @staticmethod
    def law(
        d: float,
        rate: float,
        t: float,
        strength: float,
        offset: float,
        cone: float,
        join: float,
        cone_height: float,
        steady: float,
        ac_bias: float,
        omega: float,
        a0: float,
    ) -> float:
        voltage = steady
        if ac_bias != 0.0:
            voltage += ac_bias * cos(omega * t)
        square = voltage * voltage
        near = d if d > a0 else a0
        far = near + offset
        force = strength * square / (near * far)
        if cone > 0.0:
            bracket = log(cone_height / far) - 1.0 + join / far
            force += cone * square * bracket if bracket > 0.0 else 0.0
        return -force

    @staticmethod
    def steady_sphere(
        d: float, rate: float, t: float, steady_strength: float, offset: float, a0: float, contact_force: float
    ) -> float:
        """Return the force of a sphere at a constant voltage: the same law, faster without functions of `math`."""
        return steady_strength / (d * (d + offset)) if d > a0 else contact_force

    def law_function(self) -> Callable[..., float]:
        return type(self).law if self.timed or self.geometry != "sphere" else type(self).steady_sphere

    def kinks(self) -> tuple[float, ...]:
        if self.geometry == "sphere":
            return (self.a0,)
        far = self.cone_height / exp(1.0)
        for _ in range(50):  # a contraction, as the cone is much higher than the sphere
            far = self.cone_height * exp(self.join / far - 1.0)
        return (self.a0, far - self.offset)
