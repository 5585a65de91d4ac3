"""Viscoelastic contact that relaxes as a power of time."""

from __future__ import annotations

from math import ceil, gamma, log, log10
from typing import Self

import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import Number, param
from dforce.forces._rheology import Viscoelastic

ARMS_PER_DECADE = 2  # the sum of the arms then waves by less than 1e-3 about the power law
SPACING = log(10.0) / ARMS_PER_DECADE


class PowerLaw(Viscoelastic):
    r"""Power-law rheology under a sphere, for cells and gels.

    .. math:: F = \frac{4\sqrt{R}}{3} \int_0^{t_1(t)} \psi(t - s)\, d[\delta^{3/2}], \qquad
        \psi(t) = \frac{E}{1 - \nu^2} \left(\frac{t}{t_0}\right)^{-\beta}

    with :math:`t_1` as in `sls`, with the same equations and domain. The power law is the sum
    :math:`\sum_k E_k e^{-t/\tau_k}` with two relaxation times a decade and
    :math:`E_k = E\, t_0^\beta\, \tau_k^{-\beta}\, \tfrac{\ln 10}{2} / \Gamma(\beta)`, the trapezoidal rule for
    :math:`t^{-\beta} = \tfrac{1}{\Gamma(\beta)} \int \tau^{-\beta} e^{-t/\tau}\, d\ln\tau`. Arms slower than the longest time
    are springs. No arm is faster than the shortest time, so the modulus is finite. The law is right to 1 % for times from
    three times the shortest to a tenth of the longest time. The shortest time must be longer than the step of the solver. The
    tip is rigid; set Young's modulus.
    """

    name = "power_law"
    title = "Power-law rheology"
    also_called = ("fractional", "springpot", "spring-pot", "soft glassy rheology", "SGR", "PLR", "structural damping")
    source = "Y. M. Efremov, W.-H. Wang, S. D. Hardy, R. L. Geahlen, A. Raman, Sci. Rep. 7, 1541 (2017)"

    modulus_at_reference: Number = param(
        "1 MPa", above="0 Pa", symbol="E", doc="Young's relaxation modulus at the reference time"
    )
    reference_time: Number = param("1 ms", above="0 s", symbol="t_0", doc="reference time")
    exponent: Number = param("0.2", above="0", below="1", symbol=r"\beta", doc="exponent of the relaxation")
    shortest_time: Number = param("0.1 us", above="0 s", doc="shortest relaxation time")
    longest_time: Number = param("10 ms", above="0 s", doc="longest relaxation time")

    @pydantic.model_validator(mode="after")
    def _times_are_ordered(self) -> Self:
        if self.longest_time <= self.shortest_time:
            raise ParameterError("power_law.longest_time is not above shortest_time")
        return self

    def arms(self) -> tuple[tuple[float, float], ...]:
        count = 1 + ceil(ARMS_PER_DECADE * log10(self.longest_time / self.shortest_time) - 1e-9)
        times = [self.shortest_time * 10.0 ** (k / ARMS_PER_DECADE) for k in range(count)]
        return tuple((self._arm(time), time) for time in times)

    def equilibrium(self) -> float:
        # the geometric sum of all arms that are slower than the last
        ratio = 10.0 ** (-self.exponent / ARMS_PER_DECADE)
        return float(self.arms()[-1][0] * ratio / (1.0 - ratio))

    def _arm(self, time: float) -> float:
        weight = (self.reference_time / time) ** self.exponent * SPACING / gamma(self.exponent)
        return float(self.modulus_at_reference * weight)
