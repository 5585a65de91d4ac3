"""The motion at one point of a result, computed anew: a curve does not keep its motions."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case, case_of
from dforce.core.errors import ParameterError, ResultError, checked
from dforce.core.quantities import MOTION
from dforce.experiments.base import CurvePlan
from dforce.observables.averaging import common_period
from dforce.procedures.found import Found, Layout, dataset
from dforce.procedures.motion import motion_of
from dforce.procedures.recording import record_traces
from dforce.procedures.varied import problem_at
from dforce.results.dataset import describe
from dforce.results.status import REPEATING, Status
from dforce.runs import LOOKS_A_SECOND
from dforce.solvers.accuracy import assured
from dforce.solvers.doubling import doubled_beside
from dforce.solvers.integrator import INTEGRATORS, Integrator, Motion, with_amplitudes
from dforce.solvers.parameter_range import ParameterRange
from dforce.solvers.states import States
from dforce.solvers.transient import Steady, steady
from dforce.spectroscopy.parts import parts_along

if TYPE_CHECKING:
    from collections.abc import Callable

    import xarray as xr

    from dforce.problem import Problem

SAME = 0.01  # of the free amplitude: motions nearer to each other than this are one state
PERIODS = 2  # that are recorded; tones that repeat together only after more are recorded until they do
MOST_PERIODS = 20
UNSTABLE = (
    "No experiment shows this state: it is unstable, and the smallest disturbance leads away. "
    "The picture shows the periodic motion."
)
UNSETTLED = "The motion did not settle here. The picture shows a part of it, which does not repeat."


@checked
def motion_at(point: xr.Dataset, progress: Callable[[int, int, str], None] | None = None) -> xr.Dataset:
    """Return the motion at one point of a result, as traces over two periods of the first tone.

    The search starts from the motion in the result, or from the amplitudes, phases and harmonics of the point. It returns the
    periodic orbit if one exists, stable or not, else the settled transient. If this motion is not the state of the point, an
    error is raised.

    Parameters
    ----------
    point
        A result of any experiment with one point chosen, such as ``result.sel(zc=5e-9, direction="retract")``.
    progress
        Called now and then as ``progress(0, 1, note)``; raise KeyboardInterrupt in it to stop.

    Returns
    -------
    xarray.Dataset
        Over `time`: `deflection`, `mode_deflection`, `velocity`, `distance`, `force`, `indentation`, as in a dwell, and
        `force_part` over `interaction`; also the scalars of a dwell. Tones with a longer common period are recorded until
        they repeat, up to 20 periods. ``attrs["note"]`` is a sentence if the state is unstable or did not settle, else empty.
        ``attrs["periods"]`` is the number of periods of the first tone; ``attrs["a0"]`` and ``attrs["tip_radius"]`` (m) are
        for a drawing of the tip.

    Raises
    ------
    ParameterError
        When the argument is not one point of a result, or contains no case.
    ResultError
        When the point has no motion, the case has thermal noise, or the motion was not found again.
    """
    case, problem = _origin(point)
    if case.solver.integrator == "langevin":
        raise ResultError("a motion under thermal noise never repeats; its traces are in the result of the dwell")
    reached = int(point["status"]) if point["status"].ndim == 0 else int(Status.OK)  # of basins only states are kept
    status = next(one for one in Status if one == reached)
    if status in (Status.NOT_COMPUTED, Status.FAILED, Status.UNRESOLVED):
        raise ResultError(f"this point has no motion: {status.sentence}")
    points = point.attrs.get("samples_per_period")
    integrator = INTEGRATORS[case.solver.integrator](problem, case.solver, point.sizes.get("harmonic", 1), points)
    integrator.place(float(point["zc"]))
    start = _start(integrator, point)
    looked = time.monotonic()

    def check_cancelled() -> None:
        nonlocal looked
        if progress is not None and time.monotonic() - looked > 1.0 / LOOKS_A_SECOND:
            looked = time.monotonic()
            progress(0, 1, "settling")

    found = _orbit(integrator, start, point)
    note = UNSTABLE if found is not None and "stable" in point and not bool(point["stable"]) else ""
    if found is None and "stable" in point and not bool(point["stable"]):
        raise ResultError("this state is unstable, and its motion was not found again")
    if found is None:
        found = steady(integrator, start, check_cancelled)
        if status not in REPEATING:
            note = UNSETTLED
        elif _apart(found.values, point) > SAME * problem.tones[0].A0:
            raise ResultError("a motion from this point settles in another state, so it is not shown")
    data = _recorded(integrator, found, point)
    distance, velocity, force = (data[name].values for name in ("distance", "velocity", "force"))
    names, parts = parts_along(problem, distance, velocity, force, float(point["zc"]))
    data = describe(data.assign_coords(interaction=names).assign(force_part=(("interaction", "time"), parts)))
    data.attrs |= {"title": case.title, "note": note, "a0": problem.a0}
    if case.tip.radius is not None:
        data.attrs["tip_radius"] = case.tip.radius
    return data


def _origin(point: xr.Dataset) -> tuple[Case, Problem]:
    """Return the case of a result and the problem at the point."""
    if not {"status", "amplitude", "mode_amplitude", "zc"} <= {*point.variables}:
        raise ParameterError("this is not the result of an experiment, so it has no motion")
    more = [str(dim) for name in ("amplitude", "zc") for dim in point[name].dims if dim != "tone"]
    if more:
        raise ParameterError(f"a motion belongs to one point; choose a point along {more[0]} with .isel")
    case = case_of(point)
    return case, problem_at(case, point)


def _start(integrator: Integrator, point: xr.Dataset) -> Motion:
    """Return the motion that a result keeps at a point, else a motion with the amplitudes and phases of the point."""
    problem = integrator.problem
    if MOTION in point.variables:
        return motion_of(point, problem)
    tones, modes = len(problem.tones), len(problem.modes)
    amplitudes = np.zeros((tones, modes), dtype=complex)
    for n in range(modes):
        driven = (j for j, tone in enumerate(problem.tones) if tone.mode == n)
        j = next(driven, 0)
        lag = np.radians(float(point["mode_phase"][n]))
        amplitudes[j, n] = float(point["mode_amplitude"][n]) * np.exp(1j * (problem.tones[j].phase - lag))
    start = with_amplitudes(integrator, amplitudes)
    z, v = np.array(start.y[::2]), np.array(start.y[1::2])
    z[0] += float(point["mean_deflection"]) / integrator.scales.length
    if "harmonic_amplitude" in point and modes == 1:  # with several modes the mode of a harmonic is unknown
        first = problem.tones[0]
        for h, amplitude, lag in zip(
            point["harmonic"].values[1:],
            point["harmonic_amplitude"].values[1:],
            np.radians(point["harmonic_phase"].values[1:]),
            strict=True,
        ):
            turned = amplitude * np.exp(1j * (h * first.phase - lag))
            z[0] += turned.real / integrator.scales.length
            v[0] -= 2.0 * np.pi * h * first.frequency * turned.imag / integrator.scales.speed
    return replace(start, y=tuple(np.stack([z, v], axis=1).ravel().tolist()))


def _orbit(integrator: Integrator, start: Motion, point: xr.Dataset) -> Steady | None:
    """Return the periodic orbit that Newton's method finds from a motion, None where it is none of the point's state."""
    problem = integrator.problem
    zc, A0 = float(point["zc"]), problem.tones[0].A0
    if common_period([tone.frequency for tone in problem.tones]) is None:
        return None
    settings, points = integrator.settings, integrator.points
    among = ParameterRange(lambda _: problem, zc - A0, zc + A0, settings, integrator.harmonics, points=points)
    repeats, state = _repeats(point, among.common), States.of(start)
    guess = np.append(among.vectors(state), zc / among.span)
    sought = repeats if MOTION in point.variables else 1
    found = assured(among, lambda finer: finer.find(guess, state.branch, repeats=sought))
    if found is not None and repeats > found.repeats:
        doubled = [among.steady(one) for one in doubled_beside(among, found, repeats)]
        deepest = float(point["min_distance"])
        steady = min(doubled, key=lambda one: abs(one.values["min_distance"] - deepest), default=None)
        if steady is not None and abs(steady.values["min_distance"] - deepest) > SAME * A0:
            steady = None
    else:
        steady = None if found is None else among.steady(found)
    return steady if steady is not None and _apart(steady.values, point) <= SAME * A0 else None


def _repeats(point: xr.Dataset, common: int) -> int:
    """Return after how many common periods the motion at a point repeats."""
    periods = float(point["repeat_periods"]) if "repeat_periods" in point else np.nan
    return int(periods) // common if np.isfinite(periods) else 1


def _apart(values: Any, point: xr.Dataset) -> float:
    """Return how far two motions are apart at the first tone (m)."""
    one = float(values["amplitude"][0]) * np.exp(-1j * np.radians(float(values["phase"][0])))
    other = float(point["amplitude"][0]) * np.exp(-1j * np.radians(float(point["phase"][0])))
    return float(abs(one - other))


def _recorded(integrator: Integrator, found: Steady, point: xr.Dataset) -> xr.Dataset:
    place = CurvePlan("zc", np.array([float(point["zc"])]), [()])
    data = dataset(Layout([place], {}), [Found.of([found], [integrator.problem])], integrator.problem)
    common = common_period([tone.frequency for tone in integrator.problem.tones])
    if common is not None:
        common *= _repeats(point, common)
    count = common if common is not None and PERIODS < common <= MOST_PERIODS else PERIODS
    record_traces(data, integrator, found.motion, count)
    data.attrs["periods"] = count
    return data
