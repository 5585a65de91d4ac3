"""Adhesive contact between the limits of DMT and JKR."""

from __future__ import annotations

from functools import lru_cache
from math import pi, sqrt
from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.core.parameters import MaybeNumber, param
from dforce.forces._adhesion import AdhesiveContact

TERMS = 20
FARTHEST = 49.0  # root of the depth above pull-off to which the force is fitted
END = FARTHEST / (1.0 + FARTHEST)
SHARPEST, BLUNTEST = -20.0, 12.0  # ln sqrt(m² - 1): far inside, and a contact that shrank to a point
TRANSITION_RANGE = (1e-3, 1e4)  # beyond it the limits are reached to 1e-3


class MaugisDugdale(AdhesiveContact):
    r"""Maugis' contact of a sphere whose adhesion reaches a finite distance beyond the contact: DMT to JKR.

    .. math:: \frac{\lambda A^2}{2}\left[s + (m^2 - 2)\theta\right] + \frac{4\lambda^2 A}{3}
        \left[s\theta - m + 1\right] = 1, \qquad s = \sqrt{m^2 - 1},\ \theta = \arctan s

    .. math:: \bar F = A^3 - \lambda A^2 (s + m^2 \theta), \qquad \bar\delta = A^2 - \tfrac{4}{3} A \lambda s

    with :math:`K = \tfrac{4}{3} E_\mathrm{eff}`, work of adhesion :math:`W = 2\gamma`, contact radius
    :math:`A (\pi W R^2/K)^{1/3}`, adhesive radius :math:`m` times this radius, :math:`\bar F = F/\pi W R`, :math:`\bar\delta =
    (a_0 - d) / (\pi^2 W^2 R/K^2)^{1/3}` and the transition parameter :math:`\lambda = 2 \sigma_0 (R/\pi W K^2)^{1/3}`,
    :math:`\sigma_0 = 1.026\, W/a_0`. The tip snaps into contact at :math:`d = a_0` and detaches at the end of the branch, at
    the largest distance or with a contact of zero size. The force on the branch is a polynomial, fitted at the start of a run,
    with an error below 5e-5 of :math:`\pi W R`.

    Outside contact :math:`-H R/6 d^2`, limited to its value at first contact; by default the Hamaker constant is :math:`24 \pi
    \gamma a_0^2`, and connects both forces in the DMT limit. Checked: both Tabor limits and the published equations at several
    :math:`\lambda`.
    """

    name = "maugis_dugdale"
    title = "Maugis–Dugdale"
    also_called = ("Maugis", "Dugdale", "JKR-DMT transition", "adhesive contact")
    source = "D. Maugis, J. Colloid Interface Sci. 150, 243 (1992)"

    hamaker: MaybeNumber = param(
        None, unit="J", low="0 J", symbol="H", doc="Hamaker constant outside contact; default: from the surface energy"
    )

    @property
    def transition(self) -> float:
        """Maugis' parameter lambda (1)."""
        work, stiffness = 2.0 * self.gamma, 4.0 / 3.0 * self.E_eff
        stress = 1.026 * work / self.a0
        return float(2.0 * stress * (self.radius / (pi * work * stiffness**2)) ** (1.0 / 3.0))

    @property
    def length(self) -> float:
        """Unit of the indentation (m)."""
        work, stiffness = 2.0 * self.gamma, 4.0 / 3.0 * self.E_eff
        return float((pi**2 * work**2 * self.radius / stiffness**2) ** (1.0 / 3.0))

    @property
    def strength(self) -> float:
        """Unit of the force, pi W R (N)."""
        return 2.0 * pi * self.gamma * self.radius

    @property
    def pull_off(self) -> float:
        """Indentation at which the tip comes off, negative (m)."""
        return branch(self.transition)[0] * self.length

    @property
    def fitted(self) -> tuple[float, ...]:
        """Coefficients of the force on the branch over (1 + x)^3 (1)."""
        return branch(self.transition)[1]

    @property
    def attraction(self) -> float:
        """Attraction outside contact times the distance squared, HR/6 (N m^2)."""
        if self.hamaker is None:
            return 2.0 * self.strength * self.a0**2
        return self.hamaker * self.radius / 6.0

    @property
    def strongest(self) -> float:
        """Attraction in first contact (N)."""
        return -self.strength * on_branch(0.0, self.pull_off / self.length, self.fitted)

    @staticmethod
    def law(
        d: float,
        rate: float,
        t: float,
        latched: float,
        length: float,
        strength: float,
        pull_off: float,
        fitted: tuple[float, ...],
        attraction: float,
        strongest: float,
        a0: float,
    ) -> float:
        if latched < 0.5:
            near = d if d > a0 else a0
            return -min(attraction / (near * near), strongest)
        return strength * on_branch((a0 - d) / length, pull_off / length, fitted)

    @staticmethod
    def switch(
        latched: float,
        d: float,
        rate: float,
        t: float,
        length: float,
        strength: float,
        pull_off: float,
        fitted: tuple[float, ...],
        attraction: float,
        strongest: float,
        a0: float,
    ) -> float:
        return d - a0 + pull_off if latched > 0.5 else a0 - d

    def kinks(self) -> tuple[float, ...]:
        return self.ends(self.pull_off, sqrt(self.attraction / self.strongest))


def on_branch(depth: float, lowest: float, fitted: tuple[float, ...]) -> float:
    """Return the force over pi W R at a depth in units; beyond the fit it grows as Hertz' law."""
    x = sqrt(depth - lowest) if depth > lowest else 0.0
    beyond = 0.0
    if x > FARTHEST:
        edge = lowest + FARTHEST * FARTHEST
        beyond = depth * sqrt(depth) - edge * sqrt(edge)
        x = FARTHEST
    place = 2.0 / END * x / (1.0 + x) - 1.0
    total = 0.0
    for i in range(len(fitted) - 1, -1, -1):
        total = total * place + fitted[i]
    return (1.0 + x) * (1.0 + x) * (1.0 + x) * total + beyond


def contact(spread: Array | float, transition: float) -> tuple[Any, Any, Any]:
    """Return contact radius A, force and depth of Maugis' equations, for ln sqrt(m² - 1) and lambda."""
    s = np.exp(spread)
    m = np.sqrt(1.0 + s * s)
    angle = np.arctan(s)
    # where m is close to 1 the terms of both brackets cancel, and their series are used
    first = np.where(s < 0.03, s**3 * (4.0 / 3.0 - 8.0 / 15.0 * s**2 + 12.0 / 35.0 * s**4), s + (m * m - 2.0) * angle)
    second = np.where(s < 0.01, s * s * (0.5 - 5.0 / 24.0 * s * s), s * angle - (m - 1.0))
    square, linear = transition / 2.0 * first, 4.0 / 3.0 * transition**2 * second
    size = 2.0 / (linear + np.sqrt(linear * linear + 4.0 * square))
    force = size**3 - transition * size**2 * (s + m * m * angle)
    return size, force, size**2 - 4.0 / 3.0 * size * transition * s


@lru_cache(maxsize=256)
def branch(transition: float) -> tuple[float, tuple[float, ...]]:
    """Return the depth at pull-off in units, and the polynomial of the force on the branch in contact."""
    transition = min(max(transition, TRANSITION_RANGE[0]), TRANSITION_RANGE[1])
    end = _end_of_branch(transition)
    lowest = float(contact(end, transition)[2])
    place = 0.5 * END * (1.0 - np.cos(np.pi * (np.arange(TERMS) + 0.5) / TERMS))  # Chebyshev's points
    x = place / (1.0 - place)
    low, high = np.full(TERMS, SHARPEST), np.full(TERMS, end)
    for _ in range(60):  # the depth falls as the adhesive ring grows: bisection, to the last digit
        middle = 0.5 * (low + high)
        deep = contact(middle, transition)[2] > lowest + x * x
        low, high = np.where(deep, middle, low), np.where(deep, high, middle)
    scaled = contact(0.5 * (low + high), transition)[1] / (1.0 + x) ** 3
    series = np.polynomial.chebyshev.chebfit(2.0 * place / END - 1.0, scaled, TERMS - 1)
    return lowest, tuple(map(float, np.polynomial.chebyshev.cheb2poly(series)))


def _end_of_branch(transition: float) -> float:
    """Return ln sqrt(m² - 1) where the depth is smallest, or where the contact is a point."""
    grid = np.linspace(SHARPEST, BLUNTEST, 2001)
    i = int(np.argmin(contact(grid, transition)[2]))
    if i == len(grid) - 1:
        return BLUNTEST
    low, high = float(grid[i - 1]), float(grid[i + 1])
    for _ in range(80):
        third = (high - low) / 3.0
        falling = contact(low + third, transition)[2] > contact(high - third, transition)[2]
        low, high = (low + third, high) if falling else (low, high - third)
    return 0.5 * (low + high)
