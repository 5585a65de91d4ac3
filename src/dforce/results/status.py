"""What became of each point of a result."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.errors import ParameterError

if TYPE_CHECKING:
    import xarray as xr


class Status(enum.IntEnum):
    """What became of a point of a result; `sentence` says it in words."""

    sentence: str

    def __new__(cls, value: int, sentence: str) -> Status:
        """Make the number carry its sentence."""
        member = int.__new__(cls, value)
        member._value_ = value
        member.sentence = sentence
        return member

    OK = 0, "the motion settled"
    NOT_SETTLED = 1, "the motion had not settled after the largest number of periods allowed"
    NOT_REPEATING = 2, "the motion settled into one that does not repeat from period to period"
    NOT_COMPUTED = 3, "the run was stopped before this point"
    FAILED = 4, "the motion grew beyond all bounds, so that there is no result here"
    UNRESOLVED = 5, "the force is too steep for the samples, so that there is no result here"
    INACCURATE = 6, "the motion settled, but its numbers are less accurate than asked for"
    BROKEN = 7, "computing these cases ended with an error, which `notes` tells"

    @property
    def meaning(self) -> str:
        """Return the word for it in a Dataset's `flag_meanings`."""
        return self.name.lower()


REPEATING = (Status.OK, Status.INACCURATE)  # of motions that settled and repeat from period to period


def repeats(status: Any) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return at which points the motion settled into one that repeats."""
    return np.isin(status, REPEATING)


def check_computed(result: xr.Dataset) -> None:
    """Refuse the result of a run that was stopped before its first point.

    Raises
    ------
    ParameterError
        When no point of the result was computed.
    """
    if "status" in result and bool((result["status"].values == Status.NOT_COMPUTED).all()):
        raise ParameterError(
            "the run was stopped before its first point, so its result holds no number yet: go on with it"
        )
