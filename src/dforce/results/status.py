"""The outcome of each point of a result."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.arrays import Array, Bools
from dforce.core.errors import ParameterError, checked

if TYPE_CHECKING:
    import xarray as xr


class Status(enum.IntEnum):
    """The outcome of a point of a result; `sentence` explains it."""

    sentence: str

    def __new__(cls, value: int, sentence: str) -> Status:
        """Make the number carry its sentence."""
        member = int.__new__(cls, value)
        member._value_ = value
        member.sentence = sentence
        return member

    OK = 0, "the motion settled"
    NOT_SETTLED = 1, "the motion did not settle within the largest number of periods"
    NOT_REPEATING = 2, "the motion settled, but does not repeat from period to period"
    NOT_COMPUTED = 3, "the run was stopped before this point"
    FAILED = 4, "the motion or a force became infinite or not a number; this point has no result"
    UNRESOLVED = 5, "the force is too steep for the samples, or the tip sticks; this point has no result"
    INACCURATE = 6, "the motion settled, but its numbers are less accurate than solver.accuracy"
    BROKEN = 7, "these cases ended with an error; see `notes`"
    NO_STATE = (
        8,
        "the locked state ended before this point: a fold, a tip that sticks, or too weak a drive; this point has no result",
    )

    @property
    def meaning(self) -> str:
        """The word of the status in `flag_meanings` of a Dataset."""
        return self.name.lower()


WORTHLESS = 1e-2  # of a quantity's scale: with a larger error a point has no numbers
WITHOUT_RESULT = (Status.FAILED, Status.UNRESOLVED, Status.NO_STATE)
REPEATING = (Status.OK, Status.INACCURATE)  # of motions that settled and repeat from period to period


def repeats(status: Any) -> Bools:
    """Return the points at which the motion settled and repeats."""
    return np.asarray(np.any([np.asarray(status) == one for one in REPEATING], axis=0))


def graded(error: Array, accuracy: float | None) -> np.ndarray[Any, np.dtype[np.int8]]:
    """Return the statuses of points by their estimated errors; an unknown error, or no promised accuracy, changes nothing."""
    if accuracy is None:
        return np.full(error.shape, Status.OK, dtype=np.int8)
    lost = (error > WORTHLESS) & np.isfinite(error)
    return np.where(lost, Status.UNRESOLVED, np.where(error > accuracy, Status.INACCURATE, Status.OK)).astype(np.int8)


@checked
def count_status(dataset: xr.Dataset) -> dict[Status, int]:
    """Return the number of points of each status in the result; a status without points is left out."""
    values = np.ravel(dataset["status"].values) if "status" in dataset else np.array([])
    return {status: int(np.sum(values == status)) for status in Status if np.any(values == status)}


def keep_promise(result: xr.Dataset, accuracy: float | None) -> None:
    """Call no point ok whose estimated error is above the accuracy promised, however its status came about."""
    error, status = result.variables.get("error_estimate"), result.variables.get("status")
    if accuracy is None or error is None or status is None or error.dims != status.dims:
        return  # basins have states of their own, and no estimates
    status.values[(status.values == Status.OK) & (error.values > accuracy)] = Status.INACCURATE


def whole(result: xr.Dataset) -> xr.Dataset:
    """Return a result that is complete: work of several runs ends with the first that is stopped.

    Raises
    ------
    KeyboardInterrupt
        When the run of the result was stopped.
    """
    if result.attrs.get("interrupted"):
        raise KeyboardInterrupt
    return result


def check_computed(result: xr.Dataset) -> None:
    """Refuse the result of a run that was stopped before its first point.

    Raises
    ------
    ParameterError
        When no point of the result was computed.
    """
    status = result.variables["status"].values if "status" in result else np.array([])
    if status.size and (status == Status.NOT_COMPUTED).all():
        raise ParameterError(
            "the run was stopped before its first point, so its result has no numbers yet: continue it"
        )
