"""How a case is to be solved: the keys of `[solver]`."""

from __future__ import annotations

from typing import Any, ClassVar, Literal, Self

import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import Parameters


class SolverSettings(Parameters):
    """How the steady motion is found: the integrator, its sampling, and when the motion counts as settled."""

    title_of: ClassVar[str] = "solver"

    method: Literal["periodic", "transient"] = pydantic.Field(
        default="periodic",
        description="periodic: find the periodic orbit itself (by rk4); transient: integrate until the motion has settled",
    )
    integrator: Literal["rk4", "engine", "lsoda", "adaptive", "langevin"] = pydantic.Field(
        default="rk4",
        description="rk4: fixed steps locked to the drive; lsoda: SciPy's; adaptive: lands on the force's kinks; langevin: "
        "fixed steps with thermal motion, for a dwell",
    )
    points_per_period: int = pydantic.Field(
        default=256,
        ge=16,
        le=65_536,
        description="samples per period of the first tone; raised where a faster tone or mode needs more",
    )
    accuracy: float | None = pydantic.Field(
        default=1e-4,
        ge=1e-8,
        le=0.01,
        description="periodic: error of each quantity as a share of its scale; found again with more samples where it is "
        "larger; left out beside points_per_period: the samples stay as given",
    )
    relative_tolerance: float = pydantic.Field(
        default=1e-10,
        ge=1e-13,
        le=1e-3,
        description="error per step allowed by lsoda and adaptive, relative to the motion",
    )
    settle: Literal["converged", "fixed"] = pydantic.Field(
        default="converged",
        title="How long the motion settles",
        description="converged: until amplitudes and phases stop moving; fixed: a count of periods",
    )
    settle_tolerance: float = pydantic.Field(
        default=1e-6,
        ge=1e-12,
        le=0.1,
        title="Remaining change that counts as settled",
        description="converged: remaining change of a tone, relative to the free amplitude",
    )
    max_periods: int | None = pydantic.Field(
        default=None,
        ge=1,
        le=1_000_000_000,
        title="Most periods to settle",
        description="converged: give up after so many periods; left out: 40 decay times of the slowest mode, at least 400",
    )
    periods: int = pydantic.Field(
        default=400,
        ge=0,
        le=1_000_000_000,
        title="Periods before the measurement",
        description="fixed: periods before the measurement",
    )
    measured_periods: int = pydantic.Field(
        default=8,
        ge=1,
        le=1_000_000,
        description="periods measured once settled; raised to whole common periods of all tones",
    )

    @pydantic.model_validator(mode="before")
    @classmethod
    def _samples_as_given(cls, given: Any) -> Any:
        """Promise no accuracy where only the samples are given."""
        if isinstance(given, dict) and "points_per_period" in given and "accuracy" not in given:
            return given | {"accuracy": None}
        return given

    @pydantic.model_validator(mode="before")
    @classmethod
    def _transient_where_asked_for(cls, given: Any) -> Any:
        """Let settings that only a transient has choose it, where the method is left open."""
        if isinstance(given, dict) and "method" not in given and _asks_for_transient(given):
            return given | {"method": "transient"}
        return given

    @pydantic.model_validator(mode="after")
    def _method_and_integrator_agree(self) -> Self:
        if self.method == "periodic" and self.integrator not in ("rk4", "engine"):
            raise ParameterError(
                f'solver.integrator = {self.integrator} goes with method = "transient"; periodic orbits are found with rk4'
            )
        if self.method == "periodic" and self.settle == "fixed":
            raise ParameterError(
                'solver.settle = fixed goes with method = "transient"; a periodic orbit has no settling'
            )
        return self


def _asks_for_transient(given: dict[str, Any]) -> bool:
    return bool(given.get("integrator", "rk4") not in ("rk4", "engine") or given.get("settle", "converged") != "converged")
