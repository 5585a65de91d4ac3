"""Dwell: the motion at one distance, as traces over time and a spectrum."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr

from dforce.case import Case
from dforce.core.quantities import MOTION
from dforce.core.stopping import until_stopped
from dforce.experiments import Dwell
from dforce.experiments.base import Progress, initial_motion, initial_motions
from dforce.instrument.noise import detector_readings
from dforce.observables.averaging import weights
from dforce.observables.finish import finish
from dforce.problem import Problem
from dforce.procedures import locked
from dforce.procedures.found import Found, Layout, dataset
from dforce.procedures.motion import in_si
from dforce.procedures.recording import check_length, record_spectrum, record_traces
from dforce.results.status import WITHOUT_RESULT, Status
from dforce.solvers import SolverSettings
from dforce.solvers.blocks import block_type
from dforce.solvers.integrator import Engine, Integrator, Motion
from dforce.solvers.langevin import Langevin
from dforce.solvers.protocols import settle_at
from dforce.solvers.sample_counts import sample_counts
from dforce.solvers.states import States
from dforce.solvers.transient import LATE, CancelCheck, Steady, decay_periods, march, observe

if TYPE_CHECKING:
    from dforce.solvers.controlled import ControlledMotion


class Reached(NamedTuple):
    """The motion at a distance: how it started, how it is once the start is forgotten, and its numbers."""

    integrator: Integrator
    start: Motion
    motion: Motion
    found: Found
    loops: ControlledMotion | None = None


def dwell(case: Case, plan: Dwell, report_progress: Progress, _earlier: xr.Dataset | None) -> xr.Dataset:
    """Return traces, spectrum and scalars; see :func:`dforce.runs.carry_out`."""
    problem, layout = case.problem.at_height(plan.zc), Layout([plan.plan(case.problem)], {})
    reach, note = (_noisy, "periods") if case.solver.integrator == "langevin" else (_settled, "settling")
    if problem.is_locked:
        reach, note = _held if plan.controllers is None else _controlled, "locking"
    so_far = [0, 1]

    def report(*periods: int) -> None:
        so_far[:] = periods or so_far
        report_progress(so_far[0], so_far[1], note)

    with until_stopped() as stop:
        report()
        integrator, start, motion, found, loops = reach(plan, problem, case.solver, report)
    if stop.came:
        return dataset(layout, [Found.empty()], problem).assign_attrs(interrupted=1)
    data = dataset(layout, [found], problem).assign_attrs(samples_per_period=integrator.points)
    if loops is not None:
        with_loops(data, loops, problem.tones[0].frequency)
    if found.status not in WITHOUT_RESULT:
        count = plan.recorded_periods
        if plan.is_whole:
            motion, count = start, count + int(found.arrays["settling_periods"][0, 0])
        check_length(count, integrator.points)
        motion = record_traces(data, integrator, motion, count)
        record_spectrum(data, integrator, motion, plan.recorded_periods)
    report_progress(so_far[1], so_far[1], "")
    return data


def _settled(plan: Dwell, problem: Problem, settings: SolverSettings, check_cancelled: CancelCheck) -> Reached:
    """Return the motion that settles, with as many samples as it needs."""
    if plan.is_whole:  # the whole way there is asked for, so it has to be gone
        settings = settings.replace(method="transient")
    plain = block_type(settings).of_one(problem, settings, plan.harmonics)
    for points in sample_counts(plain.points, settings):
        block = block_type(settings).of_one(problem, settings, plan.harmonics, check_cancelled, points)
        [start] = initial_motions(block, np.array([plan.zc]), plan.start)
        steady = settle_at(block, start, plan.zc)
        found = Found.of([steady], [problem])
        if found.status != Status.UNRESOLVED or steady.stays:
            break
    if found.status not in WITHOUT_RESULT:
        found.arrays[MOTION] = in_si(States.of(steady.motion), problem)[None]
    return Reached(block.integrator(0, plan.zc), start, steady.motion, found)


def _held(plan: Dwell, problem: Problem, settings: SolverSettings, check_cancelled: CancelCheck) -> Reached:
    """Return the motion at the amplitude and phase that controllers hold."""
    from dforce.procedures import two_tones  # loads the compiler

    solve = two_tones.at_distance if len(problem.tones) > 1 else locked.at_distance
    found, there, states = solve(problem, settings, plan.zc, plan.harmonics, check_cancelled)
    integrator = block_type(settings).of_one(there, settings, plan.harmonics, check_cancelled).integrator(0, plan.zc)
    return Reached(integrator, states.motion(0), states.motion(0), found)


def _controlled(plan: Dwell, problem: Problem, settings: SolverSettings, check_cancelled: CancelCheck) -> Reached:
    """Return the motion that controllers lead to in time."""
    from dforce.procedures.in_time import measured  # loads the compiler
    from dforce.solvers.controlled import ToneControllers, follow

    given = plan.controllers
    assert given is not None
    loops = ToneControllers.of(problem.tones[0], given.phase_bandwidth, given.amplitude_bandwidth, given.lock_in_order)
    engine = Engine(problem.unlocked, settings, plan.harmonics)
    engine.place(plan.zc)
    start = initial_motion(engine, plan.start)
    followed = follow(engine, [plan.zc], start, [loops], check_cancelled)
    motion, rows = observe(engine, followed.motion, settings.measured_periods, check_cancelled)
    steady = measured(problem, engine, followed._replace(motion=motion), followed.ratio[-1], rows)
    found = Found.of([steady], [engine.problem])
    if found.status not in WITHOUT_RESULT:
        found.arrays[MOTION] = in_si(States.of(steady.motion), engine.problem)[None]
    return Reached(engine, start, steady.motion, found, followed)


def with_loops(data: xr.Dataset, loops: ControlledMotion, reference: float) -> None:
    """Add the values of the controllers in each period."""
    data["loop_time"] = "loop_time", np.cumsum(1.0 / loops.frequency[:, 0])
    for name, values in (
        ("loop_frequency_shift", loops.frequency - reference),
        ("loop_drive_ratio", loops.ratio),
        ("loop_amplitude", loops.amplitude),
        ("loop_phase", np.degrees(loops.phase)),
    ):
        data[name] = "loop_time", values[:, 0]


def _noisy(plan: Dwell, problem: Problem, settings: SolverSettings, check_cancelled: CancelCheck) -> Reached:
    """Return the motion under thermal noise, which never settles, once its start is forgotten.

    It lasts the chosen number of periods, or ten decay times of the slowest mode; then scalars are means over
    `measured_periods`, extremes the farthest in them, all of one run. Amplitude and phase include the detector's noise.
    """
    integrator = Langevin(problem, settings, plan.harmonics)
    integrator.place(plan.zc)
    periods = settings.periods if settings.settle == "fixed" else LATE * decay_periods(problem)
    check_length(plan.recorded_periods + (periods if plan.is_whole else 0), integrator.points)
    start = initial_motion(integrator, plan.start)
    late, _ = march(integrator, start, periods, check_cancelled)
    motion, rows = observe(integrator, late, settings.measured_periods, check_cancelled)
    even = weights([tone.frequency for tone in problem.tones], len(rows))
    added = detector_readings(
        problem.noise, problem.noise.seed, problem.tones[0].frequency, len(rows), len(problem.tones)
    )
    values = finish(problem, plan.harmonics, rows, even, even @ added)
    values |= {"settling_periods": float(periods), "drift": np.nan}
    # the balances of a steady motion hold on long means only
    found = Found.of([Steady(values, motion, settled=False, repeats=False)], [problem])
    found.status[:] = Status.OK if motion.is_finite else Status.FAILED
    return Reached(integrator, start, motion, found)
