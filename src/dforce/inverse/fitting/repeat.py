"""A fit repeated from its own result."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dforce.case import Case
from dforce.core.errors import ParameterError, checked
from dforce.experiments.base import Progress
from dforce.inverse.fitting.report import check_fit
from dforce.inverse.fitting.result import data_of
from dforce.inverse.fitting.run import fit

if TYPE_CHECKING:
    import xarray as xr


@checked
def fit_again(result: xr.Dataset, progress: Progress | bool | None = None) -> xr.Dataset:
    """Repeat a fit from its own result, with the same case, settings and data.

    Parameters
    ----------
    result
        The result of :func:`fit`.
    progress
        See :func:`dforce.run`.

    Raises
    ------
    ParameterError
        When the result is not a fit, or is from an incompatible version of dForce.
    """
    check_fit(result)
    text = result.attrs.get("start_case")
    if not isinstance(text, str):
        raise ParameterError("the result does not contain the settings of its fit")
    return fit(Case.from_toml(text), data_of(result), progress=progress)
