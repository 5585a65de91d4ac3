"""The parameter that an experiment goes along, and the problem at each value of it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from dforce.case import Case
from dforce.core.errors import ParameterError
from dforce.core.quantities import OBSERVABLES
from dforce.experiments.base import DISTANCE
from dforce.problem import Problem

if TYPE_CHECKING:
    import xarray as xr

FREQUENCY = re.compile(r"drive(?:\.tones\.(\d+))?\.frequency")


@dataclass(frozen=True)
class VariedParameter:
    """A parameter that varies.

    Attributes
    ----------
    name
        Its name in a result: the last step of its path, unless an observable has this name.
    at
        Function that returns the problem at a value (SI), at any distance.
    zc
        Average distance (m); None where it is the parameter.
    """

    name: str
    at: Callable[[float], Problem]
    zc: float | None

    def problem_at(self, value: float) -> Problem:
        """Return the problem at a value (SI), with the lever as it is at the distance there."""
        return self.at(value).at_height(value if self.zc is None else self.zc)


def varied_by(case: Case) -> VariedParameter:
    """Return the parameter that the experiment of a case goes along."""
    experiment: Any = case.experiment
    path, problem = experiment.path, case.problem
    last = path.rsplit(".", 1)[-1]
    name = last if last not in OBSERVABLES else path.replace(".", "_")
    if path == DISTANCE:
        return VariedParameter(name, lambda _: problem, None)
    frequency = FREQUENCY.fullmatch(path)
    if frequency:  # at the driving force that the case has
        there, tone = problem.at_height(experiment.zc), int(frequency[1] or 1) - 1
        return VariedParameter(name, lambda value: there.at_frequency(value, tone), experiment.zc)
    return VariedParameter(name, lambda value: case.replace(path, value).problem, experiment.zc)


def problem_at(case: Case, point: xr.Dataset) -> Problem:
    """Return the problem at one point of a result of a case, from the point's coordinates.

    A locked state becomes a state in amplitude modulation, at the frequency and drive found.

    Raises
    ------
    ParameterError
        When the case has no experiment.
    """
    if case.experiment is None:
        raise ParameterError("the result does not contain its experiment")
    if case.problem.is_locked:
        there = case.problem.unlocked
        frequencies, ratios = (point[name].values.tolist() for name in ("drive_frequency", "drive_ratio"))
        for j, (frequency, ratio) in enumerate(zip(frequencies, ratios, strict=True)):
            there = there.driven(frequency, ratio, j)
        return there
    path = varied_by(case)
    return path.problem_at(float(point[path.name])) if path.name in point.coords else case.problem
