"""Calibration of a measured curve: free part, noise, phase, and checks without any model; each step is listed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.errors import ParameterError, checked, shorten
from dforce.findings.finding import DEGREE
from dforce.inverse import checks, steps
from dforce.inverse.curve import CONVENTIONS, UNKNOWN, described
from dforce.inverse.energies import energy
from dforce.inverse.measured import check_directions, check_measured
from dforce.inverse.steps import Given, Work
from dforce.inverse.values import above_zero, ends, measured, number_of
from dforce.inverse.values import show as shown
from dforce.results.provenance import provenance

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case
    from dforce.inverse.thermal import ThermalTune

TUNE = {"f0": "Hz", "k": "N/m", "Q": "1"}
ERRORS = {"amplitude": "m", "phase": DEGREE, "amplitude_2": "m", "phase_2": DEGREE, "frequency_shift": "Hz"}
BASELINES = ("line", "none")


@checked
def calibrate(
    data: xr.Dataset,
    case: Case | None = None,
    *,
    phase_convention: str | None = None,
    thermal: ThermalTune | Mapping[str, Any] | None = None,
    free_part: Sequence[Any] | None = None,
    free_amplitude: float | str | None = None,
    free_phase: float | str | None = None,
    errors: Mapping[str, Any] | None = None,
    baseline: str = "line",
    delay: float | str | None = None,
    speed: float | str | None = None,
) -> xr.Dataset:
    r"""Return a measured curve with its noise, its free amplitude, and phases that are 90° (or the free lag) far away.

    Each step adds a sentence to the attribute `history`. The heights are corrected for the delay of the lock-in. The free
    part is the farthest stretch without a change; its scatter is the noise. A drift of the free part is subtracted, and the
    free phase is the reference. Every point is checked without a model: at resonance :math:`\sin\phi \ge A/A_0`. Virial and
    dissipated energy follow from k and Q, if known.

    Parameters
    ----------
    data
        The result of :func:`dforce.read_measured`.
    case
        The instrument: its free lag (not 90° off resonance or with base excitation), k, f0 and Q.
    phase_convention
        As in :func:`dforce.read_measured`, if it was missing there.
    thermal
        k, f0 and Q with errors: the result of :func:`dforce.thermal_tune`, or a table such as ``{"f0": "70.00(1) kHz", "k":
        "2.7(2) N/m", "Q": "180(4)"}``. They replace the values of the case.
    free_part
        Lowest and highest height of the free part (m, or texts with units), instead of a search.
    free_amplitude
        Free amplitude (m, or text with a unit), for a curve without a free part, or instead of the measured value.
    free_phase
        Phase of the free motion (degrees, or text with a unit), in the same cases; in the convention of `data`.
    errors
        Standard deviations of a point instead of the measured noise: ``{"amplitude": "60 pm", "phase": "0.3 deg"}``.
    baseline
        ``"line"``: subtract a drift of the free part as a straight line; ``"none"``: refuse a drift.
    delay, speed
        Delay of the lock-in (s), and the speed of the heights (m/s) if the curve has no `time`; or texts with units.

    Returns
    -------
    xarray.Dataset
        The curve, with `free`, `spike` and `passive_margin` along `point`, and `virial`, `dissipated_energy` and their errors
        if k and Q are known. Attributes: `amplitude_error`, `free_amplitude`, `free_amplitude_error`, `height_offset` (m),
        `phase_error`, `phase_offset`, `phase_offset_error`, `free_phase` (degrees), `neighbor_correlation`, `noise_points` (if
        the noise is measured), `k`, `f0`, `Q` with `k_error`, `f0_error`, `Q_error` if known, the same for tone 2, and
        `history`. With a case `mode_share` is the free amplitude of the mode over the free reading of the detector.

    Raises
    ------
    ParameterError
        If a necessary setting is missing, a drift is refused, or `data` is not a measured curve or already calibrated.
    ResultError
        If `data` contains numbers that are not finite.
    """
    _check(data, baseline, delay, speed)
    given = Given(
        None if free_part is None else ends(free_part, "m", "free_part", "height"),
        None if free_amplitude is None else above_zero("free_amplitude", free_amplitude, "m"),
        None if free_phase is None else number_of("free_phase", free_phase, DEGREE),
        _errors(data, errors),
        baseline,
    )
    work = Work(data.copy(deep=True), [str(line) for line in np.atleast_1d(data.attrs.get("history", []))], given)
    work.data.attrs = provenance("", "") | work.data.attrs
    _take_lever(work, case, thermal)
    if delay is not None:
        late = above_zero("delay", delay, "s")
        steps.take_delay(work, late, None if speed is None else above_zero("speed", speed, "m/s"))
    _take_sign(work, phase_convention)
    steps.find_free_part(work)
    steps.level(work)
    steps.take_amplitudes(work, case)
    steps.take_phases(work, case)
    checks.check_spikes(work)
    checks.check_passive(work, case)
    checks.check_turn(work)
    checks.check_sign(work)
    checks.check_slope(work, case)
    checks.estimate_offset(work, case)
    work.data.attrs["history"] = work.history
    if {"k", "Q"} <= set(work.data.attrs):
        work.data = work.data.merge(energy(work.data), combine_attrs="override")
        checks.tell_energies(work)
    return described(work.data)


def _check(data: xr.Dataset, baseline: str, delay: object, speed: object) -> None:
    check_measured(data)
    check_directions(data)
    if "neighbor_correlation" in data.attrs:
        raise ParameterError("data is already calibrated; pass the result of df.read_measured")
    if baseline not in BASELINES:
        raise ParameterError(f"baseline = '{shorten(baseline)}' is not one of {', '.join(BASELINES)}")
    if speed is not None and delay is None:
        raise ParameterError("speed is used only with delay; also pass delay")


def _errors(data: xr.Dataset, given: Mapping[str, Any] | None) -> dict[str, float]:
    found = {}
    for name, value in (given or {}).items():
        if name not in ERRORS or name not in data:
            known = ", ".join(key for key in ERRORS if key in data)
            raise ParameterError(f"errors: '{shorten(name)}' is not one of {known}")
        found[name] = above_zero(f"errors: {name}", value, ERRORS[name])
    return found


def _take_lever(work: Work, case: Case | None, thermal: ThermalTune | Mapping[str, object] | None) -> None:
    """Put k, f0 and Q into the attributes: of the thermal tune, else of the case, else as the file notes them."""
    if case is not None:
        problem, tone = case.problem, case.problem.tones[0]
        mode, share = problem.modes[tone.mode], abs(problem.free[0, tone.mode] / problem.detected_free[0])
        work.data.attrs |= {"k": mode.k, "f0": mode.f0, "Q": mode.Q, "drive_frequency": tone.frequency}
        work.data.attrs["mode_share"] = float(share)
        work.history.append("k, f0, Q and the drive frequency: from the case")
    if thermal is None:
        return
    table = thermal if isinstance(thermal, Mapping) else thermal.as_table()
    for name, value in table.items():
        if name not in TUNE:
            raise ParameterError(f"thermal: '{shorten(name)}' is not one of {', '.join(TUNE)}")
        found = measured(value, TUNE[name], f"thermal: {name}")
        if found.value <= 0.0:
            raise ParameterError(f"thermal: {name} = {shorten(value)} is not above 0")
        work.data.attrs[name] = found.value
        work.data.attrs.pop(f"{name}_error", None)
        if found.error is not None:
            work.data.attrs[f"{name}_error"] = found.error
        work.history.append(f"{name}: {shown(found.value, found.error, TUNE[name])}, as measured")


def _take_sign(work: Work, convention: str | None) -> None:
    """Turn the phases into lags where the file does not contain the convention."""
    known = str(work.data.attrs.get("phase_convention", UNKNOWN))
    if known != UNKNOWN:
        if convention is not None:
            raise ParameterError("phase_convention was set when the curve was read; its phases are already lags")
        return
    if convention is None:
        raise ParameterError(
            "the sign of the phases is unknown, and the curve alone cannot show it: write phase_convention = "
            "'lag' if they rise when the tip is attracted, 'lead' if they fall"
        )
    if convention not in CONVENTIONS:
        raise ParameterError(f"phase_convention = '{shorten(convention)}' is not one of {', '.join(CONVENTIONS)}")
    sign, offset = CONVENTIONS[convention]
    for name in ("phase", "phase_2"):
        if name in work.data:
            work.data[name] = sign * work.data[name] + offset
    if work.given.free_phase is not None:
        work.given = work.given._replace(free_phase=sign * work.given.free_phase + offset)
    work.data.attrs["phase_convention"] = "lag"
    work.history.append(f"phase: '{convention}' in the file, with the lag behind the drive")
