r"""Contact of a sphere with a viscoelastic sample of any number of relaxation times, memory included.

The method of dimensionality reduction: the sample is a row of independent elements along :math:`x \ge 0`, each a spring in
parallel with arms of a spring and a dashpot in series. The tip presses the element at x down to :math:`\delta - x^2/R`. The
contact is exact for a half-space: Lee and Radok's while the contact grows, Ting's while it shrinks, and every later contact on
a surface that has not recovered.

An element's states are the displacements :math:`w_k` of its dashpots. Its stress-free surface is at
:math:`u = \sum_k (E_k/E_0) w_k`, and its load per length is :math:`f = E_0 \max(0, \delta - x^2/R - u)`, positive in contact.
So no event has to be found, and the surface recovers by the same equation,
:math:`\dot w_k = (\max(\delta - x^2/R, u) - w_k)/\tau_k`.

The elements are at :math:`x_i = x_n (i/n)^2`, so that small contacts have enough of them, too. Between two elements
:math:`\delta - x^2/R - u` is a parabola in :math:`x^2`, with the mean curvature of u at both elements. It is integrated
exactly: an elastic sample gives Hertz' law for any number of elements. The error of the viscous part falls with the inverse
cube of their number in contact.

Sources: E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27, 438 (1960); T. C. T. Ting, J. Appl. Mech. 33, 845
(1966); V. L. Popov, M. Heß, Method of Dimensionality Reduction in Contact Mechanics and Friction,
Springer (2015).
"""

from __future__ import annotations

from math import inf, sqrt
from typing import Any, Self

import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import MaybeNumber, Number, param, shared
from dforce.forces._contract import Force


class ViscoelasticSphere(Force):
    """A rigid sphere in contact with a viscoelastic sample."""

    contains = ("elastic contact",)
    dissipative = True

    radius: float = shared("tip.radius")
    poisson: float = shared("sample.poisson_ratio")
    a0: float = shared("contact.a0")

    def arms(self) -> tuple[tuple[float, float], ...]:
        """Return modulus (Pa) and relaxation time (s) of each arm."""
        raise NotImplementedError

    def equilibrium(self) -> float:
        """Return the modulus after an infinite time (Pa)."""
        raise NotImplementedError

    @property
    def recovery_time(self) -> float:
        """Mean time (s) in which a free surface returns: viscosity over relaxed modulus."""
        viscosity = sum(modulus * time for modulus, time in self.arms())
        return viscosity / self.equilibrium() if self.equilibrium() > 0.0 else inf

    def kinks(self) -> tuple[float, ...]:
        return (self.a0,)


class StandardSolid(ViscoelasticSphere):
    """A standard linear solid: a spring in parallel with a spring and a dashpot in series."""

    instant_modulus: Number = param("1 GPa", above="0 Pa", symbol="E_0", doc="instantaneous Young's modulus")
    relaxed_modulus: Number = param(
        "100 MPa", low="0 Pa", symbol=r"E_\infty", doc="Young's modulus after an infinite time"
    )
    relaxation_time: Number = param("10 us", above="0 s", symbol=r"\tau", doc="relaxation time at constant strain")

    @pydantic.model_validator(mode="after")
    def _relaxes(self) -> Self:
        if self.relaxed_modulus > self.instant_modulus:
            raise ParameterError(f"{self.name}.relaxed_modulus is above instant_modulus, but a solid can only relax")
        return self

    @property
    def numbers_of_solid(self) -> tuple[float, float, float]:
        """Moduli at once and after an infinite time (Pa), and relaxation time (s)."""
        return self.instant_modulus, self.relaxed_modulus, self.relaxation_time

    def arms(self) -> tuple[tuple[float, float], ...]:
        instant, relaxed, time = self.numbers_of_solid
        return ((instant - relaxed, time),)

    def equilibrium(self) -> float:
        return self.relaxed_modulus


class Viscoelastic(ViscoelasticSphere):
    """The common part of contacts with a row of elements: elements, law and arguments."""

    max_indentation: MaybeNumber = param(
        None,
        unit="m",
        above="0 nm",
        symbol=r"\delta_\mathrm{max}",
        doc="largest indentation of the elements, beyond it the tip is a cylinder; default: tip radius",
    )
    elements: int = param(48, unit="1", low=4.0, high=1000.0, doc="number of elements along the contact's radius")

    @property
    def memory(self) -> int:  # type: ignore[override]
        """Number of states: one for each arm of each element."""
        return (self.elements + 1) * len(self.arms())

    @property
    def modulus(self) -> float:
        """Modulus at once, plane strain (Pa)."""
        return (self.equilibrium() + sum(modulus for modulus, _ in self.arms())) / (1.0 - self.poisson**2)

    @property
    def shares(self) -> tuple[float, ...]:
        """Modulus of each arm over the modulus at once (1)."""
        total = self.equilibrium() + sum(modulus for modulus, _ in self.arms())
        return tuple(modulus / total for modulus, _ in self.arms())

    @property
    def rates(self) -> tuple[float, ...]:
        """Inverse relaxation time of each arm (1/s)."""
        return tuple(1.0 / time for _, time in self.arms())

    @property
    def reach(self) -> float:
        """Radius of contact that the elements cover (m)."""
        return sqrt(self.radius * (self.radius if self.max_indentation is None else self.max_indentation))

    @staticmethod
    def law(
        d: float,
        rate: float,
        t: float,
        memory: object,
        modulus: float,
        shares: tuple[float, ...],
        rates: tuple[float, ...],
        radius: float,
        reach: float,
        a0: float,
    ) -> float:
        return load(a0 - d, memory, modulus, shares, radius, reach)

    @staticmethod
    def evolve(
        d: float,
        rate: float,
        t: float,
        memory: object,
        change: object,
        modulus: float,
        shares: tuple[float, ...],
        rates: tuple[float, ...],
        radius: float,
        reach: float,
        a0: float,
    ) -> None:
        relax(a0 - d, memory, change, shares, rates, radius, reach)


def load(depth: float, memory: Any, modulus: float, shares: tuple[float, ...], radius: float, reach: float) -> float:
    """Return the force (N) of all elements at an indentation (m)."""
    if depth <= 0.0:
        return 0.0
    arms = len(shares)
    last = len(memory) // arms - 1
    step = reach / (last * last)
    total, x, square, sunk, ahead = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(arms):
        sunk += shares[k] * memory[k]
        ahead += shares[k] * memory[arms + k]
    push, square_ahead = depth - sunk, step * step
    slope, bend = (ahead - sunk) / square_ahead, 0.0
    for i in range(1, last + 1):
        if depth * radius <= square:
            break  # the surface is nowhere above its height at rest, so nothing farther out touches
        before, inner, inner_square, sunk = push, x, square, ahead
        x, square = step * (i * i), square_ahead
        push = depth - square / radius - sunk
        bend_before = bend
        if i < last:
            ahead = 0.0
            for k in range(arms):
                ahead += shares[k] * memory[(i + 1) * arms + k]
            root = step * ((i + 1) * (i + 1))
            square_ahead = root * root
            slope_ahead = (ahead - sunk) / (square_ahead - square)
            bend = (slope_ahead - slope) / (square_ahead - inner_square)
            slope = slope_ahead
        if before > 0.0 or push > 0.0:
            near, far = inner, x
            if before > 0.0 and push > 0.0:
                total += (x - inner) * (before + (push - before) * (x + 2.0 * inner) / (3.0 * (x + inner)))
            else:
                fall = (before - push) / (square - inner_square)
                edge_square = inner_square + before / fall
                edge = sqrt(edge_square)
                near, far = (inner, edge) if before > 0.0 else (edge, x)
                total += fall * (edge_square * (far - near) - (far * far * far - near * near * near) / 3.0)
            mean = 0.5 * (bend_before + bend) if i > 1 else bend
            total += mean * (bulge(far, inner_square, square) - bulge(near, inner_square, square))
    return 2.0 * modulus * total if total > 0.0 else 0.0  # the rounding of a last touch must not pull


def bulge(x: float, inner: float, outer: float) -> float:
    """Return the integral over x of :math:`(x^2 - x_0^2)(x_1^2 - x^2)`, with these squares of the ends."""
    square = x * x
    return x * (square * ((inner + outer) / 3.0 - square / 5.0) - inner * outer)


def relax(
    depth: float,
    memory: Any,
    change: Any,
    shares: tuple[float, ...],
    rates: tuple[float, ...],
    radius: float,
    reach: float,
) -> None:
    """Write the rates of change of the dashpots' displacements (m/s) at an indentation (m)."""
    arms = len(shares)
    last = len(memory) // arms - 1
    step = reach / (last * last)
    for i in range(last + 1):
        x = step * (i * i)
        height = 0.0
        for k in range(arms):
            height += shares[k] * memory[i * arms + k]
        height = max(height, depth - x * x / radius)
        for k in range(arms):
            change[i * arms + k] = (height - memory[i * arms + k]) * rates[k]
