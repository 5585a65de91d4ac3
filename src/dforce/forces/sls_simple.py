"""Viscoelastic contact with one relaxation time and one state."""

from __future__ import annotations

from math import sqrt
from typing import Any

from dforce.forces._rheology import StandardSolid


class SLSSimple(StandardSolid):
    r"""Standard linear solid under a sphere, with the equation of growing contacts at all times.

    .. math:: \dot F + \frac{F}{\tau} = \frac{4\sqrt{R}}{3(1 - \nu^2)}
        \left[E_0 \frac{d}{dt}\delta^{3/2} + \frac{E_\infty}{\tau} \delta^{3/2}\right], \qquad F \ge 0

    Contact ends at zero force. Then the free surface recovers by the same equation with :math:`F = 0`: its indentation
    :math:`u` follows :math:`\dot u = -\tfrac{2}{3} (E_\infty/E_0)\, u/\tau`. Contact begins again at :math:`\delta = u`. The
    state is the displacement of the dashpot to the power 3/2.

    Many simulators use this model. It is exact while the contact grows. While the contact shrinks, the model loses a little
    more energy than the exact model `sls`. The tip is rigid; set Young's moduli. Valid for indentations small relative to the
    radius and a relaxation time longer than the step of the solver.
    """

    name = "sls_simple"
    title = "Standard linear solid, simple"
    also_called = ("Zener", "three-element", "Lee-Radok")
    source = "E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27, 438 (1960)"
    memory = 1
    memory_scale = 3e-14  # m^1.5: an indentation of 1 nm

    @property
    def stiffness(self) -> float:
        """Force at once per indentation to the power 3/2 (N/m^1.5)."""
        return 4.0 / 3.0 * self.numbers_of_solid[0] / (1.0 - self.poisson**2) * sqrt(self.radius)

    @property
    def share(self) -> float:
        """Modulus of the arm over the modulus at once (1)."""
        instant, relaxed, _ = self.numbers_of_solid
        return 1.0 - relaxed / instant

    @property
    def speed(self) -> float:
        """Inverse relaxation time (1/s)."""
        return 1.0 / self.numbers_of_solid[2]

    @property
    def rates(self) -> tuple[float, ...]:
        """Inverse relaxation time (1/s)."""
        return (self.speed,)

    @staticmethod
    def law(
        d: float, rate: float, t: float, memory: Any, stiffness: float, share: float, speed: float, a0: float
    ) -> float:
        depth = a0 - d
        if depth <= 0.0:
            return 0.0
        push = depth * sqrt(depth) - share * memory[0]
        return stiffness * push if push > 0.0 else 0.0

    @staticmethod
    def evolve(
        d: float,
        rate: float,
        t: float,
        memory: Any,
        change: Any,
        stiffness: float,
        share: float,
        speed: float,
        a0: float,
    ) -> None:
        depth = a0 - d
        height = share * memory[0]
        if depth > 0.0:
            height = max(height, depth * sqrt(depth))
        change[0] = (height - memory[0]) * speed
