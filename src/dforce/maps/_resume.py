"""Checks that a stopped sweep is the same as the sweep that continues it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dforce.case import Case
from dforce.core.errors import ParameterError
from dforce.maps._result import SweepLayout
from dforce.results.provenance import OTHER_CASE, check_plugins

if TYPE_CHECKING:
    import xarray as xr


def check_same(case: Case, layout: SweepLayout, resume: xr.Dataset, set_point: float | None = None) -> None:
    """Check that a result is a sweep of a case over the values of a layout, whole curves or states at a set point.

    Raises
    ------
    ParameterError
        When it is not a sweep, or has another case, other values or another set point.
    """
    if "over" not in resume.attrs:
        raise ParameterError("this result is not a sweep, so df.sweep cannot continue it")
    if resume.attrs.get("set_point") != set_point:
        raise ParameterError(
            "this sweep does not contain the states at this set point, so it cannot be continued with them"
        )
    if resume.attrs.get("case") != case.to_toml(complete=True):
        raise ParameterError(f"this sweep belongs to another case; {OTHER_CASE}")
    check_plugins(case, resume)
    paths = [axis.path for axis in layout.axes]
    before = resume.attrs["over"].split()
    if paths != before:
        raise ParameterError(
            f"this sweep is over {', '.join(before)}, so it cannot be continued over {', '.join(paths)}"
        )
    wanted = {axis.name: (axis.path, axis.coordinate()[1]) for axis in layout.axes}
    if set_point is None:
        wanted |= {dim: (dim, np.asarray(values)) for dim, values in layout.inner.items()}  # some may have been cut off
    for dim, (path, values) in wanted.items():
        if resume[dim].values.tolist() != values.tolist():
            raise ParameterError(
                f"this sweep has other values of {path}, so it cannot be continued with the present values"
            )
    if any(resume[axis.name].dims != (axis.dim,) for axis in layout.axes):
        raise ParameterError(
            "one sweep is over all combinations, the other over single cases, so it cannot be continued"
        )
