"""Viscoelastic contact with several relaxation times."""

from __future__ import annotations

from typing import Self

import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import Number, Numbers, param
from dforce.forces._rheology import Viscoelastic


class GeneralizedMaxwell(Viscoelastic):
    r"""Generalized Maxwell solid under a sphere: a spring in parallel with any number of arms.

    .. math:: F = \frac{4\sqrt{R}}{3} \int_0^{t_1(t)} \psi(t - s)\, d[\delta^{3/2}], \qquad
        \psi(t) = \frac{E_\infty + \sum_k E_k e^{-t/\tau_k}}{1 - \nu^2}

    with :math:`t_1` as in `sls`, with the same equations and domain; one arm is the standard linear solid. The tip is rigid;
    set Young's moduli. Every relaxation time must be longer than the step of the solver.
    """

    name = "generalized_maxwell"
    title = "Generalized Maxwell solid"
    also_called = ("Prony", "Prony series", "Wiechert", "Maxwell-Wiechert", "generalized SLS", "relaxation spectrum")
    source = (
        "T. C. T. Ting, J. Appl. Mech. 33, 845 (1966); V. L. Popov, M. Heß, Method of Dimensionality "
        "Reduction, Springer (2015)"
    )

    relaxed_modulus: Number = param(
        "100 MPa", low="0 Pa", symbol=r"E_\infty", doc="Young's modulus after an infinite time"
    )
    arm_moduli: Numbers = param(
        ("600 MPa", "300 MPa"), unit="Pa", low="0 Pa", symbol="E_k", doc="Young's modulus of each arm"
    )
    arm_times: Numbers = param(
        ("1 us", "10 us"), unit="s", above="0 s", symbol=r"\tau_k", doc="relaxation time of each arm"
    )

    @pydantic.model_validator(mode="after")
    def _arms_are_pairs(self) -> Self:
        moduli, times = len(self.arm_moduli), len(self.arm_times)
        if moduli != times or not moduli:
            raise ParameterError(
                f"generalized_maxwell has {moduli} arm_moduli and {times} arm_times; each arm needs both"
            )
        if self.relaxed_modulus + sum(self.arm_moduli) <= 0.0:
            raise ParameterError("generalized_maxwell needs a modulus above 0 Pa")
        return self

    def arms(self) -> tuple[tuple[float, float], ...]:
        return tuple(zip(self.arm_moduli, self.arm_times, strict=True))

    def equilibrium(self) -> float:
        return self.relaxed_modulus
