"""The error of orbits by finite steps: estimated with more samples, and reduced with more samples where it is too large.

One Newton step from an orbit leads to the orbit with twice the samples, which is measured: nearly all of the error goes, so
the change is the error. Fewer samples would be cheaper, but errors with fewer samples mean nothing where a step is longer than
the range of the force. An orbit that is not accurate enough is replaced by an orbit with twice as many samples, and more. This
is the measured orbit, if the Newton step led right there, else an orbit that is found anew. The treatment of a point does not
depend on the points beside it. A motion that has settled in time is compared with the orbit that Newton's method finds near it
with twice the samples: the rest of the transient counts, too.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array, Indices
from dforce.core.parallel import Stopped
from dforce.kernel.codegen import ZC
from dforce.observables.averaging import weights
from dforce.observables.deviation import deviations
from dforce.observables.finish import finish_each
from dforce.observables.misfit import GROSS, misfit, misfit_each, misfit_of_rows
from dforce.problem import Problem
from dforce.solvers.block import Block
from dforce.solvers.compiled import load_kernels
from dforce.solvers.crests import passed_by
from dforce.solvers.model import DISTANCE
from dforce.solvers.orbit import Orbit
from dforce.solvers.parameter_range import ParameterRange
from dforce.solvers.points import Points, repeated
from dforce.solvers.quasi_static import Stretch
from dforce.solvers.sample_counts import MOST_SAMPLES
from dforce.solvers.settling import apart, polished, remeasured
from dforce.solvers.states import States
from dforce.solvers.transient import Steady, decay_periods, march, steady

GRACE = 2.0  # s that a run which is stopped goes on to estimate errors
PORTION = 16  # values of which it does so at once
TWICE = 2  # times the samples of an orbit, with which it is measured again
FINER = (2, 4, 16, 64)  # times the samples, one after the other
SURE = 1 / 2  # of the accuracy: an estimate is seldom too low by more
THERE = 1e-3  # of the accuracy: a Newton step so short needs not be taken
NEAR = 0.05  # of the free amplitude: an orbit found with more samples is the same orbit, if it is so near
CHANCE = 3.0  # times the error: an orbit with a larger misfit has agreed with the finer orbit by chance
LEAST_ORDER = 0.5  # of errors that more samples lower, from four times on: beside a jump of the force it is 1
ENOUGH = 4  # times the samples: a motion that breaks the tip equation with them hardly less is stuck
LOOKS, LONG = 64, 2  # periods whose errors are measured; decay times over which they are spread
SHARE = 0.1  # errors, of the drive, over how far a motion wanders; random cases of chaos have less than half of it
FEW = 0.1  # of the periods: in so few a tip may touch with one number of samples, and miss the sample with the other
ALIKE = 2.0  # ratio of the standard deviations of amplitudes that wander alike
ORDER = 3.0  # of the errors, as random cases show it: the method's 4 where the force is smooth, less behind kinks


class _Orbits:
    """Some orbits of a block: their problems, values, starts, and measurements."""

    times = 1  # the block's samples, with which the last Newton step was taken

    def __init__(self, block: Block, values: Array, points: Points, places: tuple[Indices, Indices]) -> None:
        self.block, self.cases = block, places[0]
        self.at, self.states = values[places], points.states.take(places)
        self.rows, self.monodromy, self.residual = (
            points.rows[places],
            points.monodromy[places],
            points.residual[places],
        )
        self.tables = block.tables_of(self.cases, self.at)
        self.error: Array = np.full(len(self.at), np.nan)
        # where the last Newton step led with more samples, the measurement there, and the length of the next such step
        self.next, self.next_rows, self.astray = self.states.copy(), self.rows.copy(), np.full(len(self.at), np.inf)

    def measured(self, rows: Array, which: Indices) -> dict[str, Array]:
        """Return the observables of some orbits from their measurements."""
        block, (numbers, tones) = self.block, (table[which] for table in self.tables)
        even = weights(block.frequencies, block.common)
        return finish_each(block.batch.example, block.harmonics, rows, even, numbers, tones)

    def judge(self, some: Indices, times: int) -> None:
        """Estimate the errors of some, found with so many times the block's samples, from a measurement with twice as many."""
        which = np.tile(some, 2)
        rows = self._step_on(some, self.states.take(some), TWICE * times)
        measured = self.measured(
            np.concatenate([self.rows[some], rows]), which
        )  # at once: a call costs a hundred orbits
        halves = slice(len(some)), slice(len(some), None)
        own, other = ({name: values[half] for name, values in measured.items()} for half in halves)
        numbers, tones = (table[some] for table in self.tables)
        zc = self.at[some] if self.block.parameter == DISTANCE else numbers[:, ZC]
        self.error[some] = _error(self.block.batch.example, (numbers, tones), zc, own, other)

    def _step_on(self, some: Indices, states: States, times: int) -> Array:
        """Take one Newton step with so many times the block's samples; note and return the measurement there."""
        given = self.cases[some], states, self.at[some], self.monodromy[some]
        rows, states, self.astray[some] = remeasured(self.block.finer(times * self.block.points), *given)
        self.times, self.next_rows[some] = times, rows
        self.next.put(some, states)
        return rows

    def go_over(self, some: Indices, times: int) -> Indices:
        """Go over to so many times the block's samples; return the orbits that are known then."""
        known = some[:0]
        if times == self.times and self.block.is_smooth:  # a memory may not be at rest yet
            exact = THERE * (self.block.settings.accuracy or 0.0)
            again = some[self.astray[some] > exact]
            self._step_on(again, self.next.take(again), times)
            there = (self.astray[some] <= exact) & (apart(self.next.x[some], self.states.x[some]) < NEAR)
            known, some = some[there], some[~there]
            self.rows[known], self.residual[known] = self.next_rows[known], self.astray[known]
            self.states.put(known, self.next.take(known))
        if not len(some):
            return known
        states = self.states.take(some)
        found = polished(self.block.finer(times * self.block.points), self.cases[some], states, self.at[some])
        same = np.flatnonzero((found.done == 1) & (apart(found.last_x, states.x) < NEAR))
        some = some[same]
        self.rows[some], self.monodromy[some] = found.rows[same, 0], found.monodromy[same, 0]
        self.residual[some] = found.residual[same, 0]
        self.states.put(some, States.last_of(found).take(same))
        return np.sort(np.concatenate([known, some]))


def _error(
    example: Problem, tables: tuple[Array, Array], zc: Array, own: dict[str, Array], finer: dict[str, Array]
) -> Array:
    """Return the estimated error of motions at average distances (m), (points,), from a measurement with more samples."""
    numbers, tones = tables
    changed = deviations(example, numbers, tones, own, finer).max(axis=1) / (1.0 - TWICE**-ORDER)
    passed = passed_by(example, numbers, zc, own)
    left = misfit_each(example, own, numbers, tones) / CHANCE
    return np.asarray(np.nan_to_num(np.maximum.reduce([changed, passed, left]), nan=np.inf, posinf=np.inf))


def _stays(error: Any, first: Any, times: int) -> Any:
    """Return whether errors hardly fall from the first errors with so many times the samples: more would not help."""
    return (times > TWICE) & np.isfinite(error) & np.isfinite(first) & (error > first * times**-LEAST_ORDER)


def assure(block: Block, values: Array, points: Points) -> None:
    """Write the estimated error of each orbit that has none yet, and find orbits again that are not accurate enough.

    `values` (problems, values) of the block's parameter are in SI. The states keep the block's samples.
    """
    cases, steps = np.nonzero(points.is_orbit & np.isnan(points.error))
    if not len(cases):
        return
    places = cases, steps
    orbits, accuracy = _Orbits(block, values, points, places), block.settings.accuracy
    orbits.judge(np.arange(len(cases)), 1)
    if accuracy is not None:
        doubtful, first = np.flatnonzero(orbits.error > SURE * accuracy), orbits.error.copy()
        lost = doubtful[:0]
        for times in FINER:
            if not len(doubtful) or times * block.points > MOST_SAMPLES:
                break
            found = orbits.go_over(doubtful, times)
            if len(found):
                orbits.judge(found, times)
            lost = np.union1d(lost, np.setdiff1d(doubtful, found))
            found = found[orbits.error[found] > SURE * accuracy]
            stays = _stays(orbits.error[found], first[found], times)
            points.stays[cases[found[stays]], steps[found[stays]]] = True
            doubtful = found[~stays]
    points.rows[places], points.monodromy[places] = orbits.rows, orbits.monodromy
    points.residual[places], points.error[places] = orbits.residual, orbits.error
    if accuracy is not None:
        for i in _first_wrong(orbits, lost).tolist():
            case, step, value = int(cases[i]), int(steps[i]), float(orbits.at[i])
            points.stays[case, step] = unless_stuck(
                block.one(case), value, points.steady(block, case, step, value)
            ).stays


def _first_wrong(orbits: _Orbits, some: Indices) -> Indices:
    """Return the first of some orbits of each problem that breaks the tip equation: it decides on more samples."""
    numbers, tones = (table[some] for table in orbits.tables)
    even = weights(orbits.block.frequencies, orbits.block.common)
    wrong = some[misfit_of_rows(orbits.block.batch.example, orbits.rows[some], even, numbers, tones) > GROSS]
    return wrong[np.unique(orbits.cases[wrong], return_index=True)[1]]


def assure_settled(block: Block, value: float, found: Steady, settles_on: bool = True) -> Steady:
    """Return the only problem's motion that settled in time, with its estimated error where an orbit is found near it.

    Where it is not as accurate as asked for, fixed steps are made shorter, and the motion settles on if `settles_on`. Of a
    fixed number of periods, and of integrators that choose their own steps, only the orbit becomes more accurate.
    """
    accuracy, (problem, _) = block.settings.accuracy, block.problem(0, value)
    if found.settled and not found.repeats and not found.stays and block.settings.integrator == "rk4":
        return replace(found, is_misled=_is_misled(block, value, found))
    # no motion repeats with the tones, or none but after hours
    is_free = any(force.timed for force in problem.forces) or problem.late_surface is not None
    if is_free or found.stays or not (found.settled and found.repeats and block.repeats_together):
        return found
    settles_on = settles_on and block.settings.integrator == "rk4" and block.settings.settle == "converged"

    def settle_on(finer: Block, before: Steady) -> Steady:
        if not settles_on:
            return before
        after = steady(finer.integrator(0, value), before.motion, block.check_cancelled)
        whole = before.values["settling_periods"] + after.values["settling_periods"]
        return replace(after, values={**after.values, "settling_periods": whole}, accuracy=accuracy)

    return _assured_alone(block, value, replace(found, accuracy=accuracy), 1, settle_on)


def _is_misled(block: Block, value: float, found: Steady) -> bool:
    """Return whether errors of the steps may be the reason that the only problem's motion does not repeat.

    They drive or damp a lever of a high Q as much as its drive does, and no balance over its record shows them. Periods from
    the same states with more samples show them. In chaos such periods agree: motions diverge over many periods. A few may not
    agree, where the tip just touches: then the motion goes on with more samples, and should wander as before.
    """
    own, finer = (one.integrator(0, value) for one in (block, block.finer(ENOUGH * block.points)))
    periods, motion, missed = LONG * decay_periods(own.problem), found.motion, np.zeros(LOOKS)
    for look in range(LOOKS):
        ends = [integrator.lock_in(motion, 1)[0].y for integrator in (own, finer)]
        missed[look] = apart(*np.array(ends)[:, None])[0]
        motion, _ = march(own, motion, math.ceil(periods / LOOKS), block.check_cancelled)
    driven = np.pi * np.abs(kernel.drive_of(own.tones, len(own.problem.modes))).max()  # their change in a period
    wanders = found.values["drift"]
    allowed = driven * (min(GROSS, SHARE * wanders) if wanders > block.settings.settle_tolerance else GROSS)
    if np.sqrt((missed**2).mean()) <= allowed:
        return False
    if np.quantile(missed, 1.0 - FEW) > allowed:
        return True
    later = [np.abs(march(one, motion, 2 * periods, block.check_cancelled, periods)[1][:, 0]) for one in (own, finer)]
    (mean, spread), (other, fine) = ((one.mean(), one.std()) for one in later)
    return not (abs(other - mean) < spread and spread / ALIKE < fine < ALIKE * spread)


def unless_stuck(block: Block, value: float, found: Steady, was_stuck: bool = False) -> Steady:
    """Return the only problem's motion, which `stays` if it breaks the tip equation and more samples do not help.

    A tip that sticks by adhesion hysteresis does so. A tip that was stuck just before, and breaks the equation, is still stuck.
    """
    if found.stays:
        return found
    problem, _ = block.problem(0, value)
    (first,) = misfit(problem, found.columns).tolist() if found.settled and found.repeats else (0.0,)
    if not first > GROSS or was_stuck or ENOUGH * block.points > MOST_SAMPLES:
        return replace(found, stays=first > GROSS and was_stuck)
    after = steady(block.finer(ENOUGH * block.points).integrator(0, value), found.motion, block.check_cancelled)
    return replace(found, stays=bool(_stays(misfit(problem, after.columns)[0], first, ENOUGH)))


def assure_repeated(block: Block, value: float, found: Steady, cycles: int) -> Steady:
    """Return the only problem's orbit of several common periods as accurate as asked for, with its estimated error."""

    def find_again(finer: Block, before: Steady) -> Steady | None:
        orbit = _orbit_near(finer, value, before, cycles)
        return None if orbit is None else repeated(finer, 0, value, orbit, (0, 0))

    return _assured_alone(block, value, found, cycles, find_again)


def _assured_alone(
    block: Block, value: float, found: Steady, cycles: int, again: Callable[[Block, Steady], Steady | None]
) -> Steady:
    """Return a motion of the only problem with its estimated error: how far it is from the orbit found with more samples.

    Where it is not as accurate as asked for, `again` gives it with the samples of another block.
    """
    accuracy, case, at = block.settings.accuracy, np.array([0]), np.array([value])
    tables, even = block.tables_of(case, at), weights(block.frequencies, block.common * cycles)
    zc, first = at if block.parameter == DISTANCE else tables[0][:, ZC], np.inf
    for times in (1, *FINER):
        if times * block.points > MOST_SAMPLES:
            break
        if times > 1:
            more = again(block.finer(times * block.points), found)
            if more is None:
                break
            found = more
        orbit = _orbit_near(block.finer(TWICE * times * block.points), value, found, cycles)
        if orbit is not None:
            exact = finish_each(block.batch.example, block.harmonics, orbit.rows[0], even, *tables)
            (error,) = _error(block.batch.example, tables, zc, found.columns, exact).tolist()
            found = replace(found, values={**found.values, "error_estimate": error})
        error = found.values.get("error_estimate", np.inf)
        if accuracy is None or error <= SURE * accuracy:
            break
        if _stays(error, first, times):
            return replace(found, stays=True)
        first = error if times == 1 else first
    return found


def _orbit_near(block: Block, value: float, found: Steady, cycles: int) -> Stretch | None:
    """Return the orbit of `cycles` common periods near a motion of the only problem; None where there is none."""
    state = States.of(found.motion)
    orbit = polished(block, np.array([0]), state, np.array([value]), cycles)
    return orbit if orbit.done[0] == 1 and apart(orbit.last_x, state.x)[0] < NEAR else None


def assured(
    among: ParameterRange, find: Callable[[ParameterRange], Orbit | None], first: Orbit | None = None
) -> Orbit | None:
    """Return the orbit of a curve that is found with enough samples for the accuracy asked for, with its estimated error.

    Parameters
    ----------
    find
        Finds it in a range with more samples; None where it does not.
    first
        The orbit with the range's samples; left out: it is found, too.
    """
    accuracy, found = among.settings.accuracy, None
    for times in (1, *FINER):
        if times * among.points > MOST_SAMPLES:
            break
        finer = among.finer(times)
        orbit = first if first is not None and times == 1 else find(finer)
        if orbit is None or (found is not None and np.abs(orbit.u - found.u).max() > NEAR):
            break
        found = replace(orbit, error=_error_on_curve(finer, orbit))
        if accuracy is None or found.error <= SURE * accuracy:
            break
    return found


def _error_on_curve(among: ParameterRange, orbit: Orbit) -> float:
    """Return the estimated error of an orbit: how far it lies from the curve that twice the samples lead to."""
    block, zc = among.block(orbit.value), among.distance(orbit.value)
    u, rows = among.finer(TWICE).remeasured(orbit)
    tables = block.tables_of(np.zeros(2, np.int64), np.full(2, zc))
    even = weights(block.frequencies, len(rows))
    both = finish_each(block.batch.example, block.harmonics, np.stack([orbit.rows, rows]), even, *tables)
    own, other = ({name: values[place : place + 1] for name, values in both.items()} for place in (0, 1))
    numbers, tones = (table[:1] for table in tables)
    (error,) = _error(block.batch.example, (numbers, tones), np.array([zc]), own, other).tolist()
    return max(float(error), float(among.unit * abs(u[-1] - orbit.u[-1])))


def assure_in_grace(block: Block, values: Array, points: Points) -> int:
    """Do as `assure` for a stopped run, from the first value on, for some seconds at most; return how many values are done.

    Nothing is compiled for it.
    """
    end, usual, count = time.monotonic() + GRACE, block.check_cancelled, len(values.T)

    def check_cancelled() -> None:
        if time.monotonic() > end:
            raise Stopped

    block.check_cancelled = check_cancelled
    try:
        for first in range(0, count, PORTION):
            some = slice(first, first + PORTION)
            unknown = points[some].is_orbit & np.isnan(points[some].error)
            if unknown.any() and not _at_once(block):
                return first
            check_cancelled()
            assure(block, values[:, some], points[some])
    except Stopped:
        return first
    finally:
        block.check_cancelled = usual
    return count


def _at_once(block: Block) -> bool:
    """Return whether errors can be estimated before anything is compiled."""
    _, solvers = load_kernels(block.batch.example)
    return all(solvers.is_ready(name) for name in ("march", "follow"))
