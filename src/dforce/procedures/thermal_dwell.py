"""A dwell under thermal noise: it never settles, so it is measured once its start is forgotten."""

from __future__ import annotations

import numpy as np
import xarray as xr

from dforce.core.stopping import until_stopped
from dforce.experiments import Dwell
from dforce.experiments.base import Progress, initial_motion
from dforce.instrument.noise import detector_readings
from dforce.observables.averaging import weights
from dforce.observables.finish import finish
from dforce.problem import Problem
from dforce.procedures.found import Found, Layout, dataset
from dforce.procedures.recording import check_length, record_spectrum, record_traces
from dforce.results.status import Status
from dforce.solvers import SolverSettings
from dforce.solvers.langevin import Langevin
from dforce.solvers.transient import LATE, Steady, decay_periods, march, observe


def thermal_dwell(plan: Dwell, problem: Problem, settings: SolverSettings, progress: Progress) -> xr.Dataset:
    """Return traces, spectrum and scalars of a dwell under thermal noise, all of one run; see :func:`dforce.runs.carry_out`.

    It settles for the periods asked for, or ten decay times of the slowest mode; then scalars are means over
    `measured_periods`, extremes the farthest in them, and traces and spectrum follow. What the detector adds by itself is in
    amplitude and phase.
    """
    integrator = Langevin(problem, settings, plan.harmonics)
    integrator.place(plan.zc)
    layout = Layout([plan.plan(problem)], {})

    def check_cancelled() -> None:
        progress(0, 1, "periods")

    periods = settings.periods if settings.settle == "fixed" else LATE * decay_periods(problem)
    count = plan.recorded_periods + (periods if plan.is_whole else 0)
    check_length(count, integrator.points)
    with until_stopped() as stop:
        check_cancelled()
        first = initial_motion(integrator, plan.start)
        late, _ = march(integrator, first, periods, check_cancelled)
        motion, rows = observe(integrator, late, settings.measured_periods, check_cancelled)
    if stop.came:
        return dataset(layout, [Found.empty()], problem).assign_attrs(interrupted=1)
    even = weights([tone.frequency for tone in problem.tones], len(rows))
    added = detector_readings(
        problem.noise, problem.noise.seed, problem.tones[0].frequency, len(rows), len(problem.tones)
    )
    values = finish(problem, integrator.scales, plan.harmonics, rows, even, even @ added)
    values |= {"settling_periods": float(periods), "drift": np.nan}
    # it never settles: the balances of a steady motion hold on long means only
    found = Found.of([Steady(values, motion, settled=False, repeats=False)], [problem])
    found.status[:] = Status.OK if motion.is_finite else Status.FAILED
    data = dataset(layout, [found], problem)
    data.attrs["samples_per_period"] = integrator.points
    if motion.is_finite:
        motion = record_traces(data, integrator, first if plan.is_whole else motion, count)
        record_spectrum(data, integrator, motion, plan.recorded_periods)
    progress(1, 1, "")
    return data
