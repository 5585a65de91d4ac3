"""`df.fit_many`: many curves, each fitted from the same start."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Unpack

from dforce.case import Case
from dforce.core.errors import DForceError, checked
from dforce.core.stopping import late_stop_waits, until_stopped
from dforce.inverse.fitting.load import measured_curves
from dforce.inverse.fitting.result import together
from dforce.inverse.fitting.run import FitSettings, fit, settings_of
from dforce.runs import watched

if TYPE_CHECKING:
    import xarray as xr

    from dforce.experiments.base import Progress


@checked
def fit_many(
    case: Case,
    curves: Mapping[str, Any],
    free: Sequence[str] | None = None,
    progress: Progress | bool | None = None,
    **settings: Unpack[FitSettings],
) -> xr.Dataset:
    """Fit many curves, each from the same start; a failed curve does not stop the others.

    Parameters
    ----------
    case, free, settings
        As in :func:`fit`.
    curves
        Measured curves, or their files, by name; the curves of one file get numbers.
    progress
        See :func:`dforce.run`; it counts the finished curves.

    Returns
    -------
    xarray.Dataset
        Over `curve` and `parameter`: `value`, `error`, `error_low`, `error_high`, `error_given`, `seen`. Over `curve`:
        `chi2`, `degrees_of_freedom`, `lost_points`, `doubt` (a sentence if the model does not describe the curve), `advised`
        (whether the fit has advice), and `message`, a sentence for each failed curve. For a map also the places `x` and `y`
        (m). A stopped result omits the unfinished curves, and ``attrs["interrupted"]`` is 1.

    Raises
    ------
    ParameterError
        When no curve was fitted.
    KeyboardInterrupt
        When stopped before the end of the first fit.
    """
    asked = settings_of(case, free, settings)
    done: dict[str, xr.Dataset | str] = {}
    stopped = True
    with late_stop_waits(), watched(progress, case.title) as report_progress, until_stopped():
        every = _every(case, curves)
        for number, (name, curve) in enumerate(every.items()):
            report_progress(number, len(every), name)
            try:
                if isinstance(curve, Exception):
                    raise curve
                one = fit(case, curve, **asked.model_dump())
            except DForceError as error:
                done[name] = str(error)
                continue
            except Exception as error:  # an error of one curve must not stop the others  # noqa: BLE001
                done[name] = f"{type(error).__name__}: {error}"
                continue
            if one.attrs.get("interrupted"):  # by a stop that is meant for all
                break
            done[name] = one
        else:
            stopped = False
            report_progress(len(every), len(every), "")
    if stopped and not done:
        raise KeyboardInterrupt
    return together(done, case).assign_attrs({"interrupted": 1} if stopped else {})


def _every(case: Case, curves: Mapping[str, object]) -> dict[str, Any]:
    """Return curves by their names, read from files where needed, and errors in the place of unreadable curves."""
    out: dict[str, Any] = {}
    for name, curve in curves.items():
        if not isinstance(curve, str | os.PathLike):
            out[name] = curve
            continue
        try:
            found = measured_curves(case, curve)
        except Exception as error:  # an error of one file must not stop the others  # noqa: BLE001
            out[name] = error
            continue
        several = len(found) > 1
        out |= {f"{name}, curve {n}{_label(one)}" if several else name: one for n, one in enumerate(found, 1)}
    return out


def _label(curve: xr.Dataset | DForceError) -> str:
    """Return the name of a curve in its file, in brackets, unless it is its place there."""
    label = "" if isinstance(curve, DForceError) else str(curve.attrs.get("label", ""))
    return f" ({label} in the file)" if label else ""
