"""A sweep of which only the states at a set point are kept."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from dforce.case import Case
from dforce.core.errors import ParameterError, nearest, shorten
from dforce.core.quantities import OBSERVABLES
from dforce.core.units import parse_share
from dforce.experiments import Approach
from dforce.findings.set_point import RATIO, at_set_point
from dforce.maps._result import SweepLayout

if TYPE_CHECKING:
    import xarray as xr

NEEDED = frozenset({RATIO, "virial"})  # of a curve, to find the states and say their regime


def check_set_point(case: Case, set_point: float | str | None, names: Iterable[str] | None) -> float | None:
    """Return a set point, after checking that the curves of a case's experiment may meet it and have some quantities.

    Raises
    ------
    ParameterError
        When they do not, or the set point is no share.
    """
    if set_point is None:
        return None
    if not isinstance(case.experiment, Approach):
        raise ParameterError("a set point needs the curve of an approach; use an approach as experiment")
    share = parse_share(set_point, "at_set_point")
    for name in names or ():
        if name not in OBSERVABLES:
            raise ParameterError(f"there is no quantity '{shorten(name)}' at a set point{nearest(name, OBSERVABLES)}")
    return share


def states_of(data: xr.Dataset, layout: SweepLayout, set_point: float, names: Iterable[str] | None) -> xr.Dataset:
    """Return the states of a sweep's curves at a set point.

    Parameters
    ----------
    data
        The curves, with :data:`NEEDED` and the quantities that are wanted.
    names
        The quantities that are wanted; None: all.

    Returns
    -------
    xarray.Dataset
        What :func:`dforce.at_set_point` gives, and of each case as `status` the largest number among those of its points.
    """
    found = at_set_point(data, set_point, None if names is None else sorted(names))
    status = data["status"].max(list(layout.inner)).astype(data["status"].dtype)
    return found.assign(status=status.assign_attrs(data["status"].attrs)).assign_attrs(data.attrs | found.attrs)
