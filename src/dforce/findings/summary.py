"""The summary of a result: in a few lines the numbers that a reader looks for first."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dforce.core.errors import checked
from dforce.findings.finding import Findings
from dforce.results.kinds import known_kind

if TYPE_CHECKING:
    import xarray as xr


@checked
def summary(dataset: xr.Dataset) -> Findings:
    """Return the main findings of a result; a notebook draws the list as a table.

    Raises
    ------
    ParameterError
        For a dataset that is not a result, and for a result stopped before its first point.
    """
    return Findings(known_kind(dataset).summed_up(dataset))
