"""Dwell: the motion at one distance, as traces over time and a spectrum."""

from __future__ import annotations

import numpy as np
import xarray as xr

from dforce.case import Case
from dforce.core.stopping import until_stopped
from dforce.experiments import Dwell
from dforce.experiments.base import Progress, initial_motions
from dforce.procedures.found import Found, Layout, dataset
from dforce.procedures.motion import base_of, rows_of, scales_of, with_motions
from dforce.procedures.recording import check_length, record_spectrum, record_traces
from dforce.procedures.thermal_dwell import thermal_dwell
from dforce.results.status import Status
from dforce.solvers.blocks import block_type
from dforce.solvers.protocols import settle_at
from dforce.solvers.sample_counts import sample_counts
from dforce.solvers.states import States


def dwell(case: Case, plan: Dwell, report_progress: Progress, _earlier: xr.Dataset | None) -> xr.Dataset:
    """Return traces, spectrum and scalars; see :func:`dforce.runs.carry_out`."""
    zc, harmonics, settings = plan.zc, plan.harmonics, case.solver
    problem = case.problem.at_height(zc)
    if settings.integrator == "langevin":
        return thermal_dwell(plan, problem, settings, report_progress)
    if plan.is_whole:  # the whole way there is asked for, so it has to be gone
        settings = settings.replace(method="transient")
    layout, kept = Layout([plan.plan(problem)], {}), Found.empty()
    plain = block_type(settings).of_one(problem, settings, harmonics)
    with until_stopped() as stop:
        report_progress(0, 1, "settling")
        for points, _ in sample_counts(plain.points, settings):
            block = block_type(settings).of_one(
                problem, settings, harmonics, lambda: report_progress(0, 1, "settling"), points
            )
            [first] = initial_motions(block, np.array([zc]), plan.start)
            found = settle_at(block, first, zc)
            kept = Found.of([found], [problem])
            if kept.status != Status.UNRESOLVED:
                break
    if stop.came:
        return dataset(layout, [Found.empty()], problem).assign_attrs(interrupted=1)
    data = dataset(layout, [kept], problem)
    integrator = block.integrator(0, zc)
    data.attrs["samples_per_period"] = integrator.points
    if kept.status not in (Status.FAILED, Status.UNRESOLVED):
        motion, count = found.motion, plan.recorded_periods
        if plan.is_whole:
            motion, count = first, int(found.values["settling_periods"]) + plan.recorded_periods
        check_length(count, integrator.points)
        motion = record_traces(data, integrator, motion, count)
        rows = rows_of(States.of(found.motion), scales_of(problem), base_of(problem), problem)[0]
        data = with_motions(data, (), rows, problem)
        record_spectrum(data, integrator, motion, plan.recorded_periods)
    report_progress(1, 1, "")
    return data
