"""The force behind a curve: from amplitude and phase, or a frequency shift, to force against distance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.blas_threads import one_blas_thread
from dforce.core.errors import ParameterError, checked
from dforce.findings.finding import DEGREE
from dforce.inverse.reconstruction._invert import ROUNDS, invert
from dforce.inverse.reconstruction._points import LEAST_POINTS, balances, read_points, standard_deviation
from dforce.inverse.reconstruction._result import dataset_of
from dforce.inverse.values import number_of
from dforce.runs import watched

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case
    from dforce.experiments.base import Progress

SEEN = 5.0  # errors of a virial


@checked
def reconstruct(
    curve: xr.Dataset,
    case: Case | None = None,
    amplitude_error: float | str | None = None,
    phase_error: float | str | None = None,
    progress: Progress | bool | None = None,
) -> xr.Dataset:
    r"""Return the force against distance from a tapping curve, or from frequency shifts, without a model.

    The virial of each point follows exactly from amplitude and phase. It is the mean of force times motion along the path of
    the tip,

    .. math:: V_i = \langle F(d_i(\theta))\, A_i \cos\theta \rangle,

    and linear in the force F. Least squares yield the most likely smooth force for all points, on any branch. The paths follow
    from the lever, with harmonics and mean deflection; they are updated with each new force.

    Parameters
    ----------
    curve
        A result of :func:`dforce.approach` or :func:`dforce.branches` of one tone, or a measured curve. It has along `point`
        the `height` (m, larger is farther), `amplitude` (m) and `phase` (degrees of lag, 90 when free), optional `direction`
        and `branch`. Its attributes contain `amplitude_error`, `phase_error`, `free_amplitude`, `k`, `f0` and `Q`. A curve of
        phase-locked motions has `frequency_shift` (Hz), counted from the free lock at the same phase, and
        `frequency_shift_error`. It may have `drive_force` (N) for the loss, and `phase` if it is not 90 degrees.
    case
        The instrument of a measured curve, if the curve has no `k`, `f0` and `Q`.
    amplitude_error, phase_error
        Standard deviation of a point's amplitude (m) and phase (degrees), or text with a unit; default: from the curve, and for
        a result the error of its computation.
    progress
        See :func:`dforce.run`.

    Returns
    -------
    xarray.Dataset
        Over `distance`: `force` (N) with `force_error`, its parts `force_noise` and `gap_error` (N), `resolution` (m),
        `force_status` (determined, blind, uncertain), `classic_force` (N) by each `formula` in use. Also `damping` (kg/s) if
        the sample dissipates energy, and `law_force` (N) for a simulated curve. Where no motion turns, the force is NaN. Over
        `point`: the points with their virial, energies and residuals. Over `gap`: `gap_low`, `gap_high` (m).
        ``attrs["notes"]`` is text, a sentence in each line.

    Raises
    ------
    ParameterError
        When the argument is not a curve, has too few points, unordered points, impossible numbers or more than one tone, or
        lacks values of the instrument. Also when the curve contains no force, within its errors.

    Notes
    -----
    J. E. Sader, S. P. Jarvis, Appl. Phys. Lett. 84, 1801 (2004) and H. Hölscher, Appl. Phys. Lett. 89, 123109 (2006) for the
    formulas. F. J. Giessibl, Appl. Phys. Lett. 78, 123 (2001) for a matrix inverse.
    """
    given = {"amplitude": (amplitude_error, "m"), "phase": (phase_error, DEGREE)}
    errors = {name: number_of(f"{name}_error", *one) for name, one in given.items() if one[0] is not None}
    reading, case = read_points(curve, case, errors)
    balance, shifted = balances(reading, case.problem)
    error = standard_deviation(one.virial - balance.virial for one in shifted)
    _refuse_what_tells_nothing(balance.motions.height - balance.motions.amplitude, balance.virial / error)
    lossy = bool(np.isfinite(balance.energy).all())
    with watched(progress, case.title) as report_progress, one_blas_thread():
        inverse = invert(reading, balance, shifted, lossy, lambda done: report_progress(done - 1, ROUNDS, ""))
        report_progress(ROUNDS, ROUNDS, "")
    most = _most_together(inverse.rows.closest, [gap.high for gap in inverse.gaps])
    if most < LEAST_POINTS:
        raise ParameterError(
            f"a jump divides the points, with at most {most} on one side; a force needs {LEAST_POINTS} or more"
        )
    return dataset_of(inverse, reading, case, curve, bool(case.forces) and "status" in curve)


def _refuse_what_tells_nothing(low: Any, seen: Any) -> None:
    """Raise ParameterError where no virial is five times its error, and where all points turn at one distance."""
    if np.abs(seen).max() < SEEN:
        raise ParameterError(
            "amplitude and phase equal the free lever everywhere, within their errors: the curve contains no force"
        )
    if np.ptp(low) <= 0.0:
        raise ParameterError("all points turn at the same distance, so the curve contains no force against distance")


def _most_together(closest: Any, borders: list[float]) -> int:
    """Return the largest number of points between two gaps."""
    return int(np.bincount(np.searchsorted(np.sort(borders), closest, side="right")).max())
