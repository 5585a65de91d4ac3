"""Keywords of the functions that run an experiment, such as `dforce.approach`: the settings of its table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, TypedDict

from dforce.core.units import Length, Lengths
from dforce.experiments.base import Start


class MotionSettings(TypedDict, total=False):
    """A setting of all experiments with a driven tip."""

    harmonics: int | None


class CurveSettings(MotionSettings, total=False):
    """Settings of a curve along a parameter."""

    protocol: Literal["quasi_static", "stepwise"] | None
    carry_state: bool | None
    start: Start | Mapping[str, Length] | None


class ApproachSettings(CurveSettings, total=False):
    """Settings of an approach, as under `[experiment]`."""

    direction: Literal["approach", "retract", "both"] | None
    set_point: Lengths | None


class DwellSettings(MotionSettings, total=False):
    """Settings of a dwell, as under `[experiment]`."""

    start: Start | Mapping[str, Length] | None
    record: Literal["settled", "all"] | None
    recorded_periods: int | None
    controllers: Mapping[str, object] | None


class BranchesSettings(MotionSettings, total=False):
    """Settings of branches, as under `[experiment]`."""

    parameter: str | None
    start: float | str | None
    stop: float | str | None
    largest_step: float | None
    max_points: int | None
    search: int | None
    set_point: Lengths | None


class FrequencySettings(CurveSettings, total=False):
    """Settings of a frequency sweep, as under `[experiment]`."""

    direction: Literal["up", "down", "both"] | None


class BasinsSettings(MotionSettings, total=False):
    """Settings of basins, as under `[experiment]`."""

    amplitude: Lengths | None
    phase: Lengths | None
    deflection: Lengths | None
    velocity: Lengths | None
