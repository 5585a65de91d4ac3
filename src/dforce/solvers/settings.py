"""How a case is to be solved: the keys of `[solver]`."""

from __future__ import annotations

from typing import Any, ClassVar, Literal, Self

import pydantic

from dforce.core import log
from dforce.core.errors import ParameterError
from dforce.core.parameters import Parameters

LEAST_OF_RK4 = 1e-8  # accuracy
PERIODIC = ("rk4", "engine")  # integrators that find periodic orbits


class SolverSettings(Parameters):
    """Settings of the solver: the integrator, its sampling, and the criterion of a settled motion."""

    title_of: ClassVar[str] = "solver"

    method: Literal["periodic", "transient"] = pydantic.Field(
        default="periodic",
        description="periodic: solve for the periodic orbit (rk4 or engine); transient: integrate until the motion has settled",
    )
    integrator: Literal["rk4", "engine", "lsoda", "langevin"] = pydantic.Field(
        default="rk4",
        description="rk4: fixed steps locked to the drive; engine: steps of order 8 that end on kinks; lsoda: SciPy's; "
        "langevin: thermal motion, for a dwell",
    )
    points_per_period: int = pydantic.Field(
        default=256,
        ge=16,
        le=65_536,
        description="samples per period of the first tone; raised if a faster tone or mode needs more",
    )
    accuracy: float | None = pydantic.Field(
        default=1e-4,
        ge=1e-12,
        le=0.01,
        description="periodic: error of each quantity as a share of its scale; an orbit with a larger error gets more "
        "samples; without accuracy, points_per_period is fixed",
    )
    relative_tolerance: float = pydantic.Field(
        default=1e-10,
        ge=1e-13,
        le=1e-3,
        description="allowed error per step of a transient by engine or lsoda, relative to the motion",
    )
    settle: Literal["converged", "fixed"] = pydantic.Field(
        default="converged",
        title="Settling of the motion",
        description="converged: until amplitudes and phases are constant; fixed: a number of periods",
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
        description="converged: largest number of periods; default: 40 decay times of the slowest mode, at least 400",
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
        description="measured periods after settling; raised to whole common periods of all tones",
    )

    @pydantic.model_validator(mode="before")
    @classmethod
    def _renewed(cls, given: Any) -> Any:
        return cls.renewed(given)

    @staticmethod
    def renewed(given: Any) -> Any:
        """Return the keys of `[solver]` of an older case under their present names, and announce the change."""
        if isinstance(given, dict) and given.get("integrator") == "adaptive":
            log.announce(
                'solver.integrator = "adaptive" no longer exists and runs as "engine"; write "engine" in its place.'
            )
            return {"method": "transient"} | given | {"integrator": "engine"}
        return given

    @pydantic.model_validator(mode="before")
    @classmethod
    def _samples_as_given(cls, given: Any) -> Any:
        """Promise no accuracy where only the samples are set."""
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
        if self.method == "periodic" and self.integrator not in PERIODIC:
            raise ParameterError(
                f'solver.integrator = {self.integrator} needs method = "transient"; periodic orbits use rk4 or engine'
            )
        if self.method == "periodic" and self.settle == "fixed":
            raise ParameterError('solver.settle = fixed needs method = "transient"; a periodic orbit has no settling')
        if self.integrator == "rk4" and self.accuracy is not None and self.accuracy < LEAST_OF_RK4:
            raise ParameterError(
                f'solver.accuracy = {self.accuracy:g} is below {LEAST_OF_RK4:g}, the best of rk4; write integrator = "engine"'
            )
        return self


def _asks_for_transient(given: dict[str, Any]) -> bool:
    return bool(given.get("integrator", "rk4") not in PERIODIC or given.get("settle", "converged") != "converged")
