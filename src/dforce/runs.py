"""Runs a case: experiment, provenance, and the handling of a stop."""

from __future__ import annotations

import contextlib
import importlib
import math
import os
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from dforce.case import Case, load_case
from dforce.core.errors import ParameterError, checked
from dforce.core.progress import ProgressBar
from dforce.core.quantities import MOTION
from dforce.core.stopping import at_end, late_stop_waits
from dforce.core.units import Frequencies, Length, Lengths, Time
from dforce.experiments import Approach, Basins, Branches, Dwell, Experiment, FrequencySweep, ThermalSpectrum
from dforce.experiments.base import Progress
from dforce.experiments.keywords import (
    ApproachSettings,
    BasinsSettings,
    BranchesSettings,
    DwellSettings,
    FrequencySettings,
)
from dforce.results.dataset import describe, get_ready
from dforce.results.files import read
from dforce.results.provenance import OTHER_CASE, check_plugins, of_case
from dforce.results.significance import with_scales
from dforce.results.status import keep_promise
from dforce.validity import advice, attributes

if TYPE_CHECKING:
    import xarray as xr

RESULTS = (".nc", ".zarr")  # endings of files of results
LOOKS_A_SECOND = 20.0  # at most, so that showing progress costs nothing


@checked
def run(
    case: Case | str | os.PathLike[str], progress: Progress | bool | None = None, resume: xr.Dataset | None = None
) -> xr.Dataset:
    """Run the experiment of a case and return the result.

    Parameters
    ----------
    case
        The case, with an experiment. Or a name for :func:`load_case`: a case file, a result or a shipped example; an
        interrupted result is continued.
    progress
        True for a bar, on a terminal or in a notebook. Or a function, called as ``progress(done, total, note)`` at most
        20 times a second, and at the end.
    resume
        An interrupted result of the same case, to continue. These begin anew: a dwell, basins, a thermal spectrum, and a slow
        curve there and back whose forces have neither memory nor branches.

    Returns
    -------
    xarray.Dataset
        Quantities in SI, phases in degrees; ``attrs["units"]`` of each variable is its unit. Each point has a `status`. The
        attributes of the result contain the case, the versions and the date. After Ctrl-C or SIGTERM the result contains the
        finished points, and ``attrs["interrupted"]`` is 1.

    Raises
    ------
    ParameterError
        When the case has no experiment, or `resume` is complete, a sweep, or the result of another case.
    CaseError, ResultError
        When a name belongs to no case, or a result cannot be read.
    """
    if not isinstance(case, Case):
        name, case = case, load_case(case)
        if resume is None and Path(name).suffix.lower() in RESULTS:
            earlier = read(name)
            resume = earlier if earlier.attrs.get("interrupted") else None
    if case.experiment is None:
        raise ParameterError(
            'the case has no [experiment]; write for example kind = "approach" and '
            'zc = { of = "drive.A0", start = 1.2, stop = 0.1 }'
        )
    text = case.to_toml(complete=True)
    if resume is not None and not resume.attrs.get("interrupted"):
        raise ParameterError("this result is complete; nothing is left to continue")
    if resume is not None and "over" in resume.attrs:
        raise ParameterError("this result is a sweep; df.sweep(case, over=..., resume=...) continues it")
    if resume is not None and resume.attrs.get("case") != text:
        raise ParameterError(f"this result belongs to another case; {OTHER_CASE}")
    if resume is not None:
        check_plugins(case, resume)
    usable = resume if resume is not None and MOTION in resume else None
    with late_stop_waits() as stop, watched(progress, case.title) as report_progress:
        get_ready()
        data = carry_out(case, report_progress, usable)
        data.attrs = of_case(case, text) | data.attrs
        with_scales(data, case.problem)
        data.attrs |= attributes(advice(case, data))
        if stop.is_heard:
            data.attrs["interrupted"] = 1
    return data


def carry_out(case: Case, report_progress: Progress, earlier: xr.Dataset | None = None) -> xr.Dataset:
    """Carry out the experiment of a case, and return its result with units, words and a status for each point.

    The experiment names the function that does so: a function of the case, the experiment, `report_progress` and
    `earlier`.

    Parameters
    ----------
    report_progress
        Called with the points done, the points in all and a note. It may stop the run by raising KeyboardInterrupt; the
        finished points are returned.
    earlier
        An interrupted result of the same case, to be continued.
    """
    assert case.experiment is not None
    module, name = case.experiment.procedure.split(":")
    procedure = getattr(importlib.import_module(f"dforce.{module}"), name)
    data: xr.Dataset = describe(procedure(case, case.experiment, report_progress, earlier))
    keep_promise(data, case.solver.accuracy)
    return data


@checked
def approach(
    case: Case, zc: Lengths | None = None, progress: Progress | bool | None = None, **settings: Unpack[ApproachSettings]
) -> xr.Dataset:
    """Return amplitude, phase and every other quantity against the average distance.

    Parameters
    ----------
    case
        Instrument, sample and forces; its experiment is not used, except for the defaults of an approach.
    zc
        Average distances: an array (m), a list of texts with units, or a grid ``{"start": ..., "stop": ..., "points": ...}``.
    progress
        See :func:`run`.
    settings
        Other keys of the experiment: `direction` (``"approach"``, ``"retract"``, ``"both"``), `protocol`
        (``"quasi_static"``: so slow that the motion stays on its state until the state ends; ``"stepwise"``: sudden steps),
        `carry_state`, `start`, `set_point`, `harmonics`.

    Returns
    -------
    xarray.Dataset
        Every quantity along `zc`; with both directions also along `direction`. `motion` along `component` is the motion of
        each point at the start of a period; it repeats after `repeat_periods` periods. If the motion jumps, `jump_zc` (m)
        along `jump`, with the direction and the amplitudes (m) before and after.

    Raises
    ------
    ParameterError
        For a case or a setting that is not allowed.
    """
    return run(_with_experiment(case, Approach, {"zc": zc, **settings}), progress)


@checked
def dwell(
    case: Case, zc: Length | None = None, progress: Progress | bool | None = None, **settings: Unpack[DwellSettings]
) -> xr.Dataset:
    """Return the motion at one average distance: traces over time, spectrum and every scalar quantity.

    Parameters
    ----------
    case
        Instrument, sample and forces; its experiment is not used, except for the defaults of a dwell.
    zc
        Average distance (m), or text with a unit.
    progress
        See :func:`run`.
    settings
        Other keys of the experiment: `start`, `record`, `recorded_periods`, `harmonics`; `controllers` with the bandwidths of
        a phase-locked loop and an amplitude control in time.

    Returns
    -------
    xarray.Dataset
        All scalars of an approach, without `zc` as a dimension. Along `time` (s): `deflection`, `distance` (m), `velocity`
        (m/s), `force` (N) and others. Along `frequency` (Hz): `spectrum` (m), the amplitude spectrum of the deflection.

    Raises
    ------
    ParameterError
        For a case or a setting that is not allowed.
    """
    return run(_with_experiment(case, Dwell, {"zc": zc, **settings}), progress)


@checked
def branches(
    case: Case, zc: Lengths | None = None, progress: Progress | bool | None = None, **settings: Unpack[BranchesSettings]
) -> xr.Dataset:
    """Return all steady states along the distance or another parameter, stable and unstable, through folds.

    Parameters
    ----------
    case
        Instrument, sample and forces; its experiment is not used, except for the defaults of branches.
    zc
        Range of average distances (m, or texts with units), a pair such as ``("12 nm", "1 nm")`` that begins far away, with one
        state. With `parameter`: one distance.
    progress
        See :func:`run`.
    settings
        Other keys of the experiment: `parameter` (a path such as ``"sample.youngs_modulus"``) with `start` and
        `stop`, `largest_step`, `max_points`, `search`, `set_point`, `harmonics`.

    Returns
    -------
    xarray.Dataset
        Along the dimension `point`: the scalars of an approach, the parameter, `branch` (number of the connected curve),
        `stable`, `special` (``"fold"``, ``"period_doubling"``, ...), `motion`, `repeat_periods` and the Floquet multipliers.
        `escape` is the distance (m) of a stable state from the nearest unstable state. Along `search`: the values `searched`
        and `index_sum`, which is 1 if no single state is missing. ``attrs["completeness"]`` is a sentence about missing states.

    Raises
    ------
    ParameterError
        For a case or a setting that is not allowed.
    """
    return run(_with_experiment(case, Branches, {"zc": zc, **settings}), progress)


@checked
def frequency_sweep(
    case: Case,
    frequency: Frequencies | None = None,
    zc: Length | None = None,
    progress: Progress | bool | None = None,
    **settings: Unpack[FrequencySettings],
) -> xr.Dataset:
    """Return amplitude, phase and every other quantity against the drive frequency, at constant driving force.

    The force produces the free amplitude `A0` at the drive frequency of the case.

    Parameters
    ----------
    case
        Instrument, sample and forces; its experiment is not used, except for the defaults of a sweep.
    frequency
        Frequencies of tone 1: an array (Hz), a list of texts with units, or a grid
        ``{"start": ..., "stop": ..., "points": ...}``.
    zc
        Average distance (m), or text with a unit.
    progress
        See :func:`run`.
    settings
        Other keys of the experiment: `direction` (``"up"``, ``"down"``, ``"both"``), `protocol`, `carry_state` and `start` as
        in :func:`approach`, `harmonics`.

    Returns
    -------
    xarray.Dataset
        As :func:`approach`, along `frequency` (Hz) instead of `zc`; jumps are at `jump_frequency` (Hz).

    Raises
    ------
    ParameterError
        For a case or a setting that is not allowed.
    """
    return run(_with_experiment(case, FrequencySweep, {"frequency": frequency, "zc": zc, **settings}), progress)


@checked
def basins(
    case: Case, zc: Length | None = None, progress: Progress | bool | None = None, **settings: Unpack[BasinsSettings]
) -> xr.Dataset:
    """Return the steady state that each start at one distance leads to, and the share of each state.

    Parameters
    ----------
    case
        Instrument, sample and forces; its experiment is not used, except for the defaults of basins.
    zc
        Average distance (m), or text with a unit.
    progress
        See :func:`run`.
    settings
        Other keys of the experiment: `amplitude` and `phase`, or `deflection` and `velocity`: grids
        ``{"start": ..., "stop": ..., "points": ...}`` of the starts; `harmonics`.

    Returns
    -------
    xarray.Dataset
        `reached`, the number of the state over the two axes of the starts, 0 without a settled motion. Along the dimension
        `state`, the largest `share` first: the scalars of a dwell and `share`, relative to all starts that settle. All motions
        that do not repeat count as one state.

    Raises
    ------
    ParameterError
        For a case or a setting that is not allowed, and for more than a million starts.
    """
    return run(_with_experiment(case, Basins, {"zc": zc, **settings}), progress)


@checked
def thermal_spectrum(case: Case, duration: Time | None = None, progress: Progress | bool | None = None) -> xr.Dataset:
    r"""Return the thermal spectrum of a free lever at the detector, and its spring constants by usual calibrations.

    The simulated record is exact at its samples. If the lever includes the memory of the fluid, the density is
    :math:`\frac{4 k_B T}{\omega}\, \mathrm{Im}\left(-\frac{z}{F}\right)`. The fit of each mode is the sum of white noise, the
    tails of the other modes, and

    .. math:: S(f) = \frac{4 \langle z^2 \rangle}{\omega_0 Q}\, \frac{1}{(1 - r^2)^2 + r^2 / Q^2}, \qquad r = f / f_0

    for an optical lever calibrated by a force curve on a hard sample: :math:`\langle z^2 \rangle = s_n^2 k_B T / k_n`, with its
    sensitivity :math:`s_n` to the mode. With the memory of the fluid this form is valid only near the resonance: the fit then
    covers at most 40 % on both sides.

    Sources: H.-J. Butt, M. Jaschke, Nanotechnology 6, 1 (1995); J. E. Sader, J. W. M. Chon, P. Mulvaney, Rev. Sci. Instrum.
    70, 3967 (1999).

    Parameters
    ----------
    case
        Lever, medium and noise; drive, sample and forces have no effect. Its experiment is not used, except for the default of
        a thermal spectrum.
    duration
        Length of the record (s, or text with a unit). By default 1 s, longer for a sharp resonance, shorter for a fast one.
    progress
        See :func:`run`. A stopped record has no spectrum: the result then contains only its status.

    Returns
    -------
    xarray.Dataset
        `spectral_density` and `fitted_density` (m^2/Hz) over `frequency`; over `mode` `fitted_f0`, `fitted_Q`,
        `mode_spring_constant` by the mode's own calibration, and `true_mode_spring_constant`; over `calibration`
        `spring_constant`, the true value `true_spring_constant` for this calibration, and their ratio
        `spring_constant_ratio`. `spring_constant_error` is the relative standard error of a thermal spring constant, from the
        fit of mode 1; without detector noise it is :math:`\sqrt{2 Q / \omega_0 T}` for a record of length :math:`T`. A mode
        below the detector noise has NaN. The calibrations: ``"static, 0.817"``, right for a static sensitivity;
        ``"static, no factor"``; ``"each mode"``; ``"each mode, 0.817"``, a wrong combination; ``"Sader"``, from frequency and
        Q, if dimensions and medium are known. For a tilted lever, Sader's value is the spring constant along the normal of
        the lever, not of the sample.

    Raises
    ------
    ParameterError
        When the record is too short to resolve the resonances or too long, and for ``noise.thermal = false``.
    """
    suited = {} if isinstance(case.experiment, ThermalSpectrum) else ThermalSpectrum.suggested(case.problem)
    given = {} if duration is None else {"duration": duration}
    return run(_with_experiment(case, ThermalSpectrum, suited | given), progress)


def _with_experiment(case: Case, kind: type[Experiment], settings: Mapping[str, object]) -> Case:
    given = {key: value for key, value in settings.items() if value is not None}
    if isinstance(case.experiment, kind):
        return case.replace(experiment=case.experiment.replace(**given))
    return case.replace(experiment=kind(**given))


@contextlib.contextmanager
def watched(progress: Progress | bool | None, title: str) -> Iterator[Progress]:
    """Give a progress function that passes on few enough calls, to a bar where one is asked for.

    SIGTERM acts as Ctrl-C; neither does from the moment when progress is complete until the context ends.
    """
    shown = ProgressBar(title) if progress is True else contextlib.nullcontext(progress or None)
    with late_stop_waits(), shown as report_progress:
        yield _throttled(report_progress)


def _throttled(progress: Progress | None) -> Progress:
    """Return a progress function that passes on few enough calls, and lets a stop wait once all points are done."""
    last = -math.inf  # the clock may have started just now

    def report(done: int, total: int, note: str) -> None:
        nonlocal last
        now = time.monotonic()
        if progress is not None and (now - last >= 1.0 / LOOKS_A_SECOND or done == total):
            last = now
            progress(done, total, note)
        at_end(done == total)

    return report
