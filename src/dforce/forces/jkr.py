"""Contact of a soft, strongly adhesive sample."""

from __future__ import annotations

from math import pi, sqrt

from dforce.core.parameters import Number, param
from dforce.forces._adhesion import AdhesiveContact

Q_PULL_OFF = 3.0 ** (-1.0 / 3.0)  # where d(delta)/dq = 0: the end of the branch at a prescribed distance
DEPTH_PULL_OFF = -(3.0 ** (2.0 / 3.0))
BEND = 18.0 * Q_PULL_OFF**2  # half the second derivative of delta(q) there
CUBIC, QUARTIC = 12.0 * Q_PULL_OFF / BEND, 3.0 / BEND  # the higher terms of delta(q) there, in units of it
START = 0.11  # weight of the root in the start of `contact_size`


class JKR(AdhesiveContact):
    r"""Johnson–Kendall–Roberts contact: strong adhesion of a sphere to a soft, flat sample.

    .. math:: \bar\delta = 3 q^4 - 4 q, \qquad \bar F = q^6 - 2 q^3, \qquad q \ge 3^{-1/3}

    with :math:`\bar\delta = (a_0 - d)/u`, :math:`u = (3 \pi^2 \gamma^2 R / 16 E_\mathrm{eff}^2)^{1/3}`,
    :math:`\bar F = F / 3\pi\gamma R`, contact radius :math:`(9\pi\gamma R^2 / 4 E_\mathrm{eff})^{1/3}
    q^2` and surface energy :math:`\gamma` of one of two equal materials (work of adhesion :math:`W =
    2\gamma`). The tip snaps into contact at :math:`d = a_0`, where the force falls to
    :math:`-\tfrac{8}{3}\pi\gamma R`. The contact stays on the branch until :math:`\delta = -3^{2/3} u`, where it detaches with
    :math:`-\tfrac{5}{3}\pi\gamma R`. The branch ends there at a prescribed distance, as for a stiff lever. Without
    attraction outside contact, the sample dissipates :math:`22.516318693\, (\gamma^5 R^4 / E_\mathrm{eff}^2)^{1/3}` per cycle.

    Outside contact the force is zero, or with a Hamaker constant :math:`-H R/6 d^2`, limited to its value at first contact.
    Valid for large Tabor parameters, :math:`(R W^2 / E_\mathrm{eff}^2 a_0^3)^{1/3} > 5`, and contact radii small relative to R.
    """

    name = "jkr"
    also_called = ("JKRS", "Johnson-Kendall-Roberts", "Johnson-Kendall-Roberts-Sperling", "adhesive contact")
    source = "K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. London A 324, 301 (1971)"

    hamaker: Number = param("0 J", low="0 J", symbol="H", doc="Hamaker constant of the attraction outside contact")

    @property
    def length(self) -> float:
        """Unit u of the indentation (m)."""
        return float((3.0 * pi**2 * self.gamma**2 * self.radius / (16.0 * self.E_eff**2)) ** (1.0 / 3.0))

    @property
    def strength(self) -> float:
        """Pull-off force under a dead load (N)."""
        return 3.0 * pi * self.gamma * self.radius

    @property
    def attraction(self) -> float:
        """Attraction outside contact times the distance squared, HR/6 (N m^2)."""
        return self.hamaker * self.radius / 6.0

    @staticmethod
    def law(
        d: float, rate: float, t: float, latched: float, length: float, strength: float, attraction: float, a0: float
    ) -> float:
        if latched < 0.5:
            near = d if d > a0 else a0
            pull = attraction / (near * near)
            return -min(pull, 8.0 / 9.0 * strength)
        cube = contact_size((a0 - d) / length) ** 3
        return strength * cube * (cube - 2.0)

    @staticmethod
    def switch(
        latched: float, d: float, rate: float, t: float, length: float, strength: float, attraction: float, a0: float
    ) -> float:
        return d - a0 + DEPTH_PULL_OFF * length if latched > 0.5 else a0 - d

    def kinks(self) -> tuple[float, ...]:
        return self.ends(DEPTH_PULL_OFF * self.length, sqrt(self.attraction / (8.0 / 9.0 * self.strength)))


def contact_size(depth: float) -> float:
    """Return q of the indentation in units u; beyond pull-off its value there.

    With q above its value at pull-off by r, and the depth above its value there by s^2 in units of `BEND`, the equation is
    r^2 (1 + CUBIC r + QUARTIC r^2) = s^2. Its root is like s at first, and like the root of s far inside. The start has both
    limits and errs by 3 % at most; each of Halley's steps cubes the error.
    """
    square = max(depth - DEPTH_PULL_OFF, 0.0) / BEND
    s = sqrt(square)
    r = s * sqrt((1.0 + START * s) / (1.0 + s * (CUBIC + START + START * sqrt(QUARTIC) * s)))
    for _ in range(2):
        off = r * r * (1.0 + r * (CUBIC + QUARTIC * r)) - square
        slope = r * (2.0 + r * (3.0 * CUBIC + 4.0 * QUARTIC * r))
        curvature = 1.0 + r * (3.0 * CUBIC + 6.0 * QUARTIC * r)  # half of it
        r -= off * slope / (slope * slope - off * curvature + 1e-300)
    return Q_PULL_OFF + r
