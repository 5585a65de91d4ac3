"""The measured curve that a case names, read and calibrated by its table `[data]`."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from dforce.case import Case, Data
from dforce.core.errors import DForceError, ParameterError, nearest, shorten
from dforce.core.files import named
from dforce.inverse.calibration import calibrate
from dforce.inverse.measured import each_curve, read_measured

if TYPE_CHECKING:
    import xarray as xr

CALIBRATED = "neighbor_correlation"  # an attribute that calibration leaves


def measured_curve(case: Case, given: xr.Dataset | str | os.PathLike[str] | None) -> xr.Dataset:
    """Return a measured curve: the argument, or read from a file and calibrated.

    Raises
    ------
    ParameterError
        Without a curve and without a file in the case, and for settings unknown to reader or calibration.
    """
    asked = case.data or Data()
    if given is not None and not isinstance(given, str | os.PathLike):
        return given
    if given is None:
        if not asked.file:
            raise ParameterError('the measured curve is missing: name its file, or write [data] file = "curve.csv"')
        given = named(asked.file, "data.file", case.folder)
    data = read_measured(given, **reading_of(asked))
    return data if CALIBRATED in data.attrs else calibrate(data, case, **calibration_of(asked))


def measured_curves(case: Case, path: str | os.PathLike[str]) -> list[xr.Dataset | DForceError]:
    """Return all curves of a file, read and calibrated; the error in the place of a curve that cannot be read.

    Raises
    ------
    DForceError
        When the file itself cannot be read, and for settings unknown to reader or calibration.
    """
    asked = case.data or Data()
    how = calibration_of(asked)
    out: list[xr.Dataset | DForceError] = []
    for one in each_curve(path, reading_of(asked)):
        if isinstance(one, DForceError) or CALIBRATED in one.attrs:
            out.append(one)
            continue
        try:
            out.append(calibrate(one, case, **how))
        except DForceError as error:
            out.append(error)
    return out


def reading_of(asked: Data) -> dict[str, Any]:
    """Return the arguments of :func:`dforce.read_measured`; see :func:`known_settings`."""
    named: dict[str, Any] = {"columns": dict(asked.columns) or None, "units": dict(asked.units) or None}
    named["phase_convention"] = asked.phase_convention or None
    return known_settings(read_measured, named, asked.read, "read")


def calibration_of(asked: Data) -> dict[str, Any]:
    """Return the arguments of :func:`dforce.calibrate`; see :func:`known_settings`."""
    return known_settings(calibrate, {}, asked.calibrate, "calibrate")


def known_settings(
    function: Callable[..., Any], given: dict[str, Any], more: Mapping[str, object], table: str
) -> dict[str, Any]:
    """Return the arguments of a function: settings by name, and more from a table of `[data]`.

    Raises
    ------
    ParameterError
        For a setting that it does not have.
    """
    keys = [name for name, one in inspect.signature(function).parameters.items() if one.kind is one.KEYWORD_ONLY]
    for name in more:
        if name not in keys:
            raise ParameterError(f"data.{table} has no setting '{shorten(name)}'{nearest(name, keys)}")
    return {name: value for name, value in given.items() if value is not None} | dict(more)
