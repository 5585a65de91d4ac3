"""What one may ask of a server that others use too."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import dforce as df
from dforce.core.parameters import Parameters

# costs time, which is limited by itself, and no memory unless all of the motion is recorded
TIME_ALONE = ("solver.max_periods", "solver.periods", "solver.measured_periods")


@dataclass(frozen=True)
class Limits:
    """Limits for each session.

    Attributes
    ----------
    seconds
        Time that a run may take; what is computed by then is kept.
    count
        Largest whole number in an experiment or for the solver that costs memory: points, periods recorded, samples.
    """

    seconds: float = math.inf
    count: float = math.inf

    def check(self, case: df.Case) -> df.Case:
        """Return the case.

        Raises
        ------
        ParameterError
            When it asks for more than the limits allow.
        """
        free = TIME_ALONE if getattr(case.experiment, "record", "") != "all" else ()
        for section in ("experiment", "solver"):
            given = getattr(case, section)
            for path, number in _whole_numbers(given, section) if given is not None else ():
                if number > self.count and path not in free:
                    raise df.ParameterError(f"{path} = {number} is above {self.count:.0f}, the limit of this server")
        return case


ALONE = Limits()
"""Of a server on one's own computer: none."""

SHARED = Limits(seconds=300.0, count=2000)
"""Of a server that is open to others; the longest trace that they allow takes some 200 MB while it is computed."""


def _whole_numbers(given: Parameters, path: str) -> Iterator[tuple[str, int]]:
    """Give the whole numbers that were typed into a table of parameters and those below it; defaults are fine."""
    for key in given.model_fields_set:
        value: Any = getattr(given, key)
        if isinstance(value, Parameters):
            yield from _whole_numbers(value, f"{path}.{key}")
        elif isinstance(value, int) and not isinstance(value, bool):
            yield f"{path}.{key}", value
        elif isinstance(value, tuple):
            yield f"{path}.{key}", len(value)
