"""Types of arrays, by their elements, and arrays of unequal length as one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]
Complexes = np.ndarray[Any, np.dtype[np.complex128]]
Indices = np.ndarray[Any, np.dtype[np.int64]]
Bools = np.ndarray[Any, np.dtype[np.bool_]]
Texts = np.ndarray[Any, np.dtype[np.str_]]
AnyArray = np.ndarray[Any, Any]

# a number so small is negligible in any unit; below 2e-308 a processor takes a hundred times as long
FADED = 1e-200


def stacked(arrays: Sequence[AnyArray | None], fill: object) -> AnyArray:
    """Return arrays of one number of dimensions as the rows of one, filled up where one is shorter than others or missing."""
    there = [one for one in arrays if one is not None]
    longest = map(max, zip(*(one.shape for one in there), strict=True))
    out: AnyArray = np.full((len(arrays), *longest), fill, np.result_type(*(one.dtype for one in there)))
    for i, one in enumerate(arrays):
        if one is not None:
            own: tuple[Any, ...] = tuple(map(slice, one.shape))
            out[(i, *own)] = one
    return out
