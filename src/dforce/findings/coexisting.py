"""All steady states behind a curve, with the states that its approach and retract do not reach."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dforce.case import case_of
from dforce.core.errors import ParameterError, checked
from dforce.experiments import Branches
from dforce.experiments.base import Progress
from dforce.results.curves import goes_along
from dforce.results.kinds import swept
from dforce.runs import run

if TYPE_CHECKING:
    import xarray as xr


@checked
def coexisting(curve: xr.Dataset, progress: Progress | bool | None = None, largest_step: float = 0.02) -> xr.Dataset:
    """Return all steady states over the range of an approach or a frequency sweep, stable and unstable.

    Parameters
    ----------
    curve
        Result of an approach or a frequency sweep of one case.
    progress
        See :func:`dforce.run`.
    largest_step
        Largest step along a curve of states, relative to the range and to the free amplitude.

    Returns
    -------
    xarray.Dataset
        As from :func:`dforce.branches`.

    Raises
    ------
    ParameterError
        When the result is not such a curve, or its forces have memory or branches.
    """
    along = goes_along(curve)
    if along not in ("zc", "frequency") or swept(curve) or "point" in curve.dims or curve.sizes.get(along, 0) < 2:
        raise ParameterError("this result is not a curve against the distance or the frequency")
    case = case_of(curve)
    first, last = float(curve[along].max()), float(curve[along].min())
    if along == "zc":
        plan = Branches(zc=(first, last), largest_step=largest_step)
    else:
        # read back from a frequency sweep, which keeps its average distance
        plan = Branches(
            zc=float(curve["zc"]), parameter="drive.frequency", start=last, stop=first, largest_step=largest_step
        )
    return run(case.replace(experiment=plan), progress)
