"""Curves and single distances under controllers: FM-AFM, constant excitation, phase modulation."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce import kernel
from dforce.core import units
from dforce.core.quantities import MOTION, REPEATS
from dforce.core.stopping import until_stopped
from dforce.observables.averaging import weights
from dforce.observables.deviation import deviations
from dforce.observables.finish import finish_each
from dforce.observables.misfit import GROSS, misfit_each
from dforce.procedures.found import Found, Layout, dataset
from dforce.procedures.motion import rows_of, states_of
from dforce.procedures.statuses import without_failed
from dforce.results.status import Status, graded
from dforce.solvers.accuracy import SURE
from dforce.solvers.locked import Locked, LockedAnchor, LockedStates
from dforce.solvers.locked_orbits import follow
from dforce.solvers.sample_counts import MOST_SAMPLES
from dforce.solvers.transient import never_cancelled

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case
    from dforce.core.arrays import Array, Bools, Indices
    from dforce.experiments.base import CurveExperiment, Place, Progress
    from dforce.problem import Problem
    from dforce.solvers import SolverSettings
    from dforce.solvers.states import States
    from dforce.solvers.transient import CancelCheck

AT_ONCE = 256  # distances whose states are found together: a stop loses no more
SHRINKS = 0.5  # of the error with half of the samples, at least
EXACT = 0.1  # of the accuracy: error of a mode's equation, as a share of the drive at the free lock
ROUNDING = 1e-9  # of that drive
TWICE = 2  # times the samples, with which states are found again: the change is their error


def curve(
    case: Case, experiment: CurveExperiment, report_progress: Progress, _earlier: xr.Dataset | None
) -> xr.Dataset:
    """Return the locked states along a curve; see :func:`dforce.runs.carry_out`. A stopped curve is found again as a whole."""
    plan = experiment.plan(case.problem)
    kept, total, done = Found.empty(1, len(plan.visits)), len(plan.visits), 0
    note = "free lock"

    def check_cancelled() -> None:
        report_progress(min(done, total - 1), total, note)

    locked = Locked(case.problem, case.solver, experiment.harmonics, check_cancelled, plan.name, plan.zc or 0.0)
    offset, unit = locked.scales[plan.name]
    with until_stopped() as stop:
        last: LockedAnchor | None = None
        for some in _portions(plan.visits):
            values = plan.values[[place[0] for place in plan.visits[some]]]
            note = f"{plan.name} = {units.show(float(values[0]), 'm' if plan.zc is None else 'Hz', 4)}"
            at = (values - offset) / unit
            first = begun(locked, float(at[0])) if last is None else last
            there = total - 1 - np.arange(some.start, some.stop)  # the same values on the way there
            if len(plan.visits[0]) > 1 and some.start >= total // 2 and _leads_back(locked, kept, there):
                kept.keep(
                    (0, some), {name: array[0, there] for name, array in kept.arrays.items()}, kept.status[0, there]
                )
            elif first is None:
                kept.status[0, some] = Status.NO_STATE
            else:
                found, jumps, last = follow(locked, first, at)
                kept.jumps[0] += jumps
                columns, became = observed(locked, found)
                kept.keep((0, some), columns, became)
            done = some.stop
        report_progress(total, total, "")
    data = dataset(Layout([plan], plan.coords), [kept], locked.block.batch.example)
    data = data if plan.zc is None else data.assign_coords(zc=plan.zc)
    data.attrs |= attributes(locked) | {"protocol": "quasi_static"}
    return data.assign_attrs(interrupted=1) if stop.came else data


def _leads_back(locked: Locked, kept: Found, there: Indices) -> bool:
    """Return whether a curve without jumps and memory leads back through the states that were found on the way there."""
    return locked.block.is_smooth and not kept.jumps[0] and bool((kept.status[0, there] != Status.NO_STATE).all())


def attributes(locked: Locked) -> dict[str, Any]:
    """Return the attributes of a result of locked states."""
    return {
        "samples_per_period": locked.block.points,
        "reference_frequency": locked.reference,
        "held": " ".join(locked.lock.held),
    }


def on_curve(locked: Locked, orbits: Sequence[Any]) -> tuple[Found, Array]:
    """Return the results on the orbits of a curve, and their distances (m)."""
    found, states = Found.empty(1, len(orbits)), LockedStates.joined([orbit.found for orbit in orbits])
    columns, became = observed(locked, states)
    found.keep((0, slice(None)), columns, became)
    return found, locked.number(states.unknowns, "zc")


def at_distance(
    problem: Problem, settings: SolverSettings, zc: float, harmonics: int, check_cancelled: CancelCheck
) -> tuple[Found, Problem, States]:
    """Return the results at a distance, the problem with the frequency and drive found there, and the motion."""
    locked, found = Locked(problem, settings, harmonics, check_cancelled), Found.empty()
    first = begun(locked, zc / locked.length)
    state = None if first is None else follow(locked, first, np.array([zc / locked.length]))[0]
    if state is None or not state.good[0]:
        found.status[:] = Status.NO_STATE
        return found, problem.unlocked, locked.free_motion
    columns, became = observed(locked, state)
    found.keep((0, slice(None)), columns, became)
    frequency, ratio = (float(locked.number(state.unknowns, name)[0]) for name in ("frequency", "drive"))
    there = problem.unlocked.driven(frequency, ratio)
    return found, there, locked.motions(state.unknowns, state.branch)


def at_value(
    cases: Sequence[Case], name: str, value: float, near: Mapping[str, Array]
) -> tuple[dict[str, Array], Bools]:
    """Return the locked states of one case at which a quantity has a value, and where one was found.

    Parameters
    ----------
    name
        "amplitude_ratio", or "frequency_shift" (Hz).
    near
        Guesses: "zc", "drive_frequency", "drive_ratio" and the motion, states first.
    """
    case = cases[0]
    experiment: Any = case.experiment
    level = None if name == "frequency_shift" else value
    locked = Locked(case.problem, case.solver, experiment.harmonics, never_cancelled, level=level)
    at = {"zc": near["zc"], "frequency": near["drive_frequency"][:, 0], "drive": near["drive_ratio"][:, 0]}
    if level is None:
        at["frequency"] = np.full(len(at["zc"]), locked.reference + value)
    unknowns = np.zeros((len(at["zc"]), len(locked.weights)))
    for place, one in enumerate(locked.numbers, start=locked.motion):
        offset, unit = locked.scales[one]
        unknowns[:, place] = (at[one] - offset) / unit
    start = states_of(near[MOTION], locked.block.batch.example, *_units(locked, unknowns))
    unknowns[:, : locked.motion] = start.vectors(locked.block.memory_scale)
    across = np.zeros(unknowns.shape)
    across[:, locked.motion if level is None else -1] = 1.0
    found = locked.newton(unknowns, np.round(start.branch), across=across)
    columns, _ = observed(locked, found)
    zc = locked.number(found.unknowns, "zc")
    return columns | {"zc": zc, "zc_ratio": zc / locked.length}, found.good


def begun(locked: Locked, at: float) -> LockedAnchor | None:
    """Return a state from which a curve is followed; None where there is none.

    It lies at the given distance (scaled) or far above; a curve along the frequency begins at the case's frequency.
    """
    zc, unit = locked.scales["zc"]
    if locked.numbers[-1] == "zc":
        return locked.begin(at)
    there = Locked(locked.problem, locked.block.settings, 1, locked.block.check_cancelled)
    first = there.begin(zc / unit)
    at_zc = None if first is None else follow(there, first, np.array([zc / unit]))[0]
    begin = None if at_zc is None else locked.begin_at(there, at_zc)
    return None if begin is None else follow(locked, begin, np.array([at]))[2]


def _portions(visits: list[Place]) -> Iterator[slice]:
    """Give the numbers of distances that rise or fall one after the other, so many at once."""
    end = 0
    for _, way in itertools.groupby(visits, key=lambda place: place[1:]):
        begin, end = end, end + len(list(way))
        for first in range(begin, end, AT_ONCE):
            yield slice(first, min(first + AT_ONCE, end))


def observed(locked: Locked, found: LockedStates) -> tuple[dict[str, Any], Any]:
    """Return the observables of states, with estimated errors, and their statuses."""
    count = len(found.good)
    became = np.full(count, Status.NO_STATE, dtype=np.int8)
    there = np.flatnonzero(found.good)
    if not len(there):
        return {}, became
    states, accuracy, example = found.take(there), locked.block.settings.accuracy, locked.block.batch.example
    exact = max(EXACT, ROUNDING / (accuracy or 1.0))

    def drive(some: LockedStates) -> Array:
        return locked.number(some.unknowns, "drive")

    # errors are shares of the free lock's values: at the frequency found the same drive may hardly move a free lever
    at_free_lock = np.full(len(there), locked.reference), np.ones(len(there))
    numbers, tones = locked.block.tables_driven(locked.number(states.unknowns, "zc"), *at_free_lock)
    values = measured(locked, states, 1)
    left, error, times = np.arange(len(there)), np.full(len(there), np.inf), 1
    while len(left) and TWICE * times * locked.block.points <= MOST_SAMPLES:
        times *= TWICE
        some = states.take(left)
        finer = measured(locked, some, times)
        coarser = {name: value[left] for name, value in values.items()}
        apart = deviations(example, numbers[left], tones[left], coarser, finer).max(axis=1)
        apart = np.maximum(
            apart, misfit_each(example, finer, *locked.tables(some.unknowns)) * drive(some) * SURE / exact
        )
        better = apart < SHRINKS * error[left]  # else the rest is rounding
        left = left[better]
        error[left] = apart[better]
        for name, value in finer.items():
            values[name][left] = value[better]
        for whole, part in zip(states, some.take(better), strict=True):
            whole[left] = part
        if accuracy is None:
            break
        left = left[error[left] > SURE * accuracy]
    good = misfit_each(example, values, *locked.tables(states.unknowns)) <= GROSS
    became[there] = np.where(good, graded(error, accuracy), Status.UNRESOLVED)
    for whole, part in zip(found, states, strict=True):
        whole[there] = part
    frequency, ratio = (locked.number(states.unknowns, name)[:, None] for name in ("frequency", "drive"))
    columns = values | {"error_estimate": error} | of_locks(locked.problem, frequency, ratio, values)
    columns |= _motions(locked, states)
    out = {}
    for name, value in columns.items():
        out[name] = np.full((count, *np.shape(value)[1:]), np.nan)
        out[name][there] = value
    return without_failed(out, became), became


def measured(locked: Locked, states: LockedStates, times: int) -> dict[str, Array]:
    """Return the observables of states, which are moved to where they are with so many times the samples."""
    rows = locked.measured(states, times)
    even = weights(locked.block.frequencies, locked.block.common)
    return finish_each(locked.block.batch.example, locked.block.harmonics, rows, even, *locked.tables(states.unknowns))


def of_locks(problem: Problem, frequency: Array, ratio: Array, values: dict[str, Array]) -> dict[str, Array]:
    """Return the values that locks measure instead of amplitude and phase, from frequencies (Hz) and drives, (states, tones).

    A drive is a multiple of the drive at the free lock.
    """
    reference, force = np.array([(tone.frequency, tone.force) for tone in problem.tones]).T
    shift, stiffness = frequency - reference, np.array([problem.modes[tone.mode].k for tone in problem.tones])
    driven = np.isin(np.arange(len(problem.modes)), problem.own_modes)  # another mode only answers at the first tone
    seen = np.array([abs(row[tone.mode]) for row, tone in zip(problem.readout.weights, problem.tones, strict=True)])
    if problem.shaken is not None:
        each = [
            [problem.at_frequency(one, j).tones[j].force for j, one in enumerate(row)] for row in frequency.tolist()
        ]
        force = np.array(each)
    return {
        "drive_frequency": frequency,
        "frequency_shift": shift,
        "drive_force": ratio * force,
        "drive_ratio": ratio,
        "normalized_frequency_shift": stiffness * (values["amplitude"] / seen) ** 1.5 * shift / reference,
        "mean_stiffness": np.where(driven, -2.0 * values["virial"] / values["mode_amplitude"] ** 2, np.nan),
    }


def _motions(locked: Locked, states: LockedStates) -> dict[str, Array]:
    """Return the motions of states in SI."""
    rows = rows_of(
        locked.motions(states.unknowns, states.branch), *_units(locked, states.unknowns), locked.block.batch.example
    )
    return {MOTION: rows, REPEATS: np.full(len(rows), 1.0)}


def _units(locked: Locked, unknowns: Array) -> tuple[Array, Array]:
    """Return the units of the numbers of scaled motions, and the part of each number that is the base's."""
    example, at = locked.block.batch.example, locked.number(unknowns, "frequency")
    length = np.full(len(at), locked.length)
    base = kernel.base_in_motion(example, locked.tables(unknowns)[1])
    return kernel.units_of(example, length, 2.0 * math.pi * at * length), base
