"""Curves and single distances under two tones of which a controller holds amplitude or phase: AM-FM, FM-FM."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce import kernel
from dforce.core import units
from dforce.core.quantities import MOTION
from dforce.core.stopping import until_stopped
from dforce.engine.laws import force_over, laws_of
from dforce.instrument.operation import HELD
from dforce.observables import measure
from dforce.observables.deviation import deviations
from dforce.observables.finish import finish_each
from dforce.procedures.found import Found, Layout, dataset, tabled
from dforce.procedures.in_time import InTime
from dforce.procedures.locked import of_locks
from dforce.procedures.motion import in_si
from dforce.procedures.statuses import without_failed
from dforce.results.status import Status, graded
from dforce.solvers import torus
from dforce.solvers.states import States
from dforce.solvers.torus import TONES, Held, Torus, TorusBalance, TwoToneLever
from dforce.solvers.transient import never_cancelled

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case
    from dforce.core.arrays import Array, Bools
    from dforce.experiments.base import CurveExperiment, Progress
    from dforce.problem import Problem
    from dforce.solvers import SolverSettings
    from dforce.solvers.integrator import Motion
    from dforce.solvers.torus import FoundTorus
    from dforce.solvers.transient import CancelCheck

COARSE, MOST_PHASES = (512, 32), 8192  # phases of both tones; of the first at most
FOUND = 1e-4  # of the accuracy asked for: mismatch of a torus that is found
FAR = 2.0  # sums of the set points: where an approach begins, or farther
LONGEST, SHORTEST = 0.5, 1e-4  # of the first set point: steps along the distance
MOST_AHEAD = 2.0  # times the last step along the distance: farthest prediction
NUDGE = 1e-3  # of it: first step from the guess of a distance at which a quantity has a value
MET, MOST_SECANTS = 1e-9, 8  # of this value: how well it is met; steps of the secant method
PASSED = 4097  # distances at which extremes of a force are looked for
TRIED = 20  # computations of the force before a step is made shorter


class TwoTones:
    """The tori of a problem along the distance.

    Parameters
    ----------
    problem
        A problem of two tones; at least one has a lock. Its frequencies are the frequencies of the free locks.
    """

    def __init__(self, problem: Problem, settings: SolverSettings, check_cancelled: CancelCheck) -> None:
        self.problem, self.settings, self.check_cancelled = problem, settings, check_cancelled
        self.in_time: InTime | None = None
        self.zc = np.inf
        if not has_torus(problem):
            return
        tones, first = problem.tones, problem.modes[problem.tones[0].mode]
        self.length, self.frequency = tones[0].A0, tones[0].frequency
        self.force, self.speed = first.k * self.length, self.length * kernel.scales(problem).omega
        own = np.eye(len(problem.modes))
        sees = [
            own[tone.mode] if tone.lock is not None and tone.lock.of_mode else weights
            for tone, weights in zip(tones, problem.readout.weights, strict=True)
        ]
        acts = problem.drive / np.array([[tone.force] for tone in tones])
        self.lever = TwoToneLever(problem.modes, self.frequency, first.k, acts, np.array(sees))
        self.laws, self.numbers = (
            laws_of(problem.forces),
            np.array([n for one in problem.forces for n in one.numbers()]),
        )
        self.omega = np.array([tone.frequency for tone in tones]) / self.frequency
        first_held, second_held = (self._held(j) for j in range(2))
        self.held = first_held, second_held
        self.mismatch = FOUND * (settings.accuracy or 1e-4)
        self.torus = self.balance(np.inf).free(COARSE, self.omega)
        self.before = self.zc, self.torus
        self.finest: FoundTorus | None = None

    def _held(self, j: int) -> Held:
        tone = self.problem.tones[j]
        if tone.lock is None:
            return Held(drive=tone.force / self.force, frequency=self.omega[j])
        values = (tone.force / self.force, self.omega[j], tone.A0 / self.length, tone.lock.phase)
        given = zip(Held._fields, values, strict=True)
        return Held(**{name: float(value) for name, value in given if name in tone.lock.held})

    def balance(self, zc: float) -> TorusBalance:
        """Return the equations at a distance (m)."""

        def force(z: Array, v: Array) -> Array:
            return force_over(self.laws, self.numbers, zc, zc + self.length * z, self.speed * v) / self.force

        return TorusBalance(self.lever, self.held, force, self.laws.rate)

    def at(self, zc: float) -> tuple[dict[str, Any], Status]:
        """Go to a distance (m); return the observables there and the status.

        After the last torus, controllers find the motions in time.
        """
        self._begin(zc)
        if self.in_time is None:
            if has_torus(self.problem) and (found := self._along(zc)):
                return found
            self.in_time = InTime(self.problem, self.settings, self.check_cancelled, self.zc, *self.last())
        return self.in_time.at(zc)

    def meeting(self, name: str, value: float, zc: float) -> dict[str, Any] | None:
        """Return the observables where a quantity of the first tone has a value, near a distance (m); None without a torus."""
        self._begin(zc)
        step, before = NUDGE * self.problem.tones[0].A0, np.nan
        for _ in range(MOST_SECANTS):
            found = self._along(zc) if has_torus(self.problem) else None
            if found is None:
                return None
            miss = float(np.ravel(found[0][name])[0]) - value
            if abs(miss) <= MET * abs(value):
                return found[0] | {"zc": zc, "zc_ratio": zc / self.length}
            if miss == before:  # the quantity does not change here, as where no force acts
                return None
            if np.isfinite(before):
                step = float(np.clip(step * miss / (before - miss), -LONGEST * self.length, LONGEST * self.length))
            before, zc = miss, zc + step
        return None

    def _begin(self, zc: float) -> None:
        """Begin far above a distance (m)."""
        if np.isinf(self.zc):
            self.zc = max(1.1 * zc, FAR * sum(tone.A0 for tone in self.problem.tones))

    def last(self) -> tuple[Problem, Array, Motion | None]:
        """Return the problem with the last frequencies and drives, these drives as multiples, and the motion; None: free."""
        if self.in_time is not None:
            return self.in_time.integrator.problem, self.in_time.ratio, self.in_time.motion
        if not has_torus(self.problem):
            return self.problem.unlocked, np.ones(len(self.problem.tones)), None
        found = self.finest or self.balance(self.zc).at(self.torus)
        return self.there(found.torus), self.ratio(found.torus), self.motion(found).motion(0)

    def _along(self, zc: float) -> tuple[dict[str, Any], Status] | None:
        """Go to a distance (m) from torus to torus; return as :meth:`at`, or None where there is no torus."""
        step = LONGEST * self.length
        while self.zc != zc:
            self.check_cancelled()
            place = zc if abs(zc - self.zc) <= step else self.zc + float(np.copysign(step, zc - self.zc))
            found = self.balance(place).find(self._ahead(place), self.mismatch, TRIED)
            if found.mismatch <= self.mismatch:
                self.before = self.zc, self.torus
                self.zc, self.torus, step = place, found.torus, 2.0 * step
                continue
            step = 0.25 * min(step, abs(place - self.zc))
            if step < SHORTEST * self.length:  # a fold, as a rule
                return None
        return self._observed()

    def _ahead(self, zc: float) -> Torus:
        """Return the torus that the last two predict at a distance (m)."""
        at, before = self.before
        share = (zc - self.zc) / (self.zc - at)
        if not 0.0 < share <= MOST_AHEAD:
            return self.torus
        return Torus(*(now + share * (now - old) for now, old in zip(self.torus, before, strict=True)))

    def _observed(self) -> tuple[dict[str, Any], Status] | None:
        """Return the observables of the present torus, on a grid that is made finer until they meet the accuracy."""
        accuracy, balance = self.settings.accuracy, self.balance(self.zc)
        found = balance.at(self.torus)
        values = self._values(found)
        while True:
            self.check_cancelled()
            finer = balance.find(found.torus.finer(found.needs_second), self.mismatch)
            if not finer.mismatch <= self.mismatch:
                return None
            before, values = values, self._values(finer)
            there = self.there(finer.torus)
            numbers, tables = np.array([kernel.parameters(there, 0.0)]), kernel.tone_table(there)[None]
            error = deviations(there, numbers, tables, before, values).max(axis=1)
            if accuracy is None or error[0] <= accuracy or 2 * len(finer.torus.z) > MOST_PHASES:
                [became] = graded(error, accuracy).tolist()
                columns = {name: value[0] for name, value in values.items()} | {"error_estimate": error[0]}
                columns[MOTION], self.finest = in_si(self.motion(finer), there)[0], finer
                return without_failed(columns, became), next(status for status in Status if status == became)
            found = finer

    def there(self, found: Torus) -> Problem:
        """Return the problem in amplitude modulation, at the frequencies and drives of a torus."""
        there = self.problem.unlocked
        for j, (omega, ratio) in enumerate(zip(found.omega.tolist(), self.ratio(found).tolist(), strict=True)):
            there = there.driven(self.frequency * omega, ratio, j)
        return there

    def ratio(self, found: Torus) -> Array:
        """Return the drives of a torus as multiples of the drives at the free locks."""
        return np.asarray(np.abs(found.drive) * self.force / [tone.force for tone in self.problem.tones])

    def _values(self, found: FoundTorus) -> dict[str, Array]:
        """Return the observables of a torus, a row for the one motion."""
        there, balance, motion = self.there(found.torus), self.balance(self.zc), found.torus
        z, v = motion.deflection(), motion.velocity()
        force, d = self.force * balance.force(z, v), self.zc + self.length * z
        turn = np.exp(-1j * np.angle(motion.drive))
        modes = self.lever.driven(motion.omega, motion.drive, found.force[TONES]) * turn[:, None]
        pairs = np.hstack(
            [np.hstack([modes, modes.sum(axis=1)[:, None]]).ravel(), 2.0 * self.force * found.force[TONES] * turn]
        )
        row = np.empty(measure.FIRST + 2 * len(pairs))
        row[measure.FIRST :: 2], row[measure.FIRST + 1 :: 2] = pairs.real, pairs.imag
        row[measure.Z], row[measure.F], row[measure.IN_CONTACT] = z.mean(), force.mean(), share_below(d, there.a0)
        row[measure.F_Z], row[measure.F_V] = (force * z).mean() * self.length, (force * v).mean() * self.speed
        low, high = -crest(-z), crest(z)
        row[measure.Z_MIN], row[measure.Z_MAX], row[measure.D_MIN] = low, high, self.zc + self.length * low
        row[measure.V_MAX] = crest(np.abs(v)) * self.speed
        row[measure.F_MIN], row[measure.F_MAX] = -crest(-force), crest(force)
        if not balance.has_rate:  # a function of the distance alone, of which the grid may miss a sharp end
            kinks = np.clip((kernel.kink_distances(there) - self.zc) / self.length, low, high)
            passed = self.force * balance.force(
                way := np.append(np.linspace(low, high, PASSED), kinks), np.zeros_like(way)
            )
            row[measure.F_MIN], row[measure.F_MAX] = passed.min(), passed.max()
        numbers, tables = np.array([kernel.parameters(there, 0.0)]), kernel.tone_table(there)[None]
        values = finish_each(there, 0, row[None, None], np.ones(1), numbers, tables)
        frequency = np.array([[tone.frequency for tone in there.tones]])
        return values | of_locks(self.problem, frequency, self.ratio(motion)[None], values)

    def motion(self, found: FoundTorus) -> States:
        """Return the scaled motion of a torus at time zero."""
        motion = found.torus
        pushes = np.stack([found.force] * len(self.lever.modes))
        pushes[:, TONES[0], TONES[1]] += 0.5 * self.lever.acts.T * motion.drive
        pushes[:, -1, 0] = pushes[:, 1, 0].conj()
        p, q = torus.multiples(motion.grid)
        first, second = (tone.phase - np.angle(one) for tone, one in zip(self.problem.tones, motion.drive, strict=True))
        turned = (
            self.lever.responses(motion.frequencies)
            * pushes
            * np.exp(1j * (p * first + q * second))
            * np.where(q > 0, 2, 1)
        )
        x, v = turned.sum(axis=(1, 2)).real, (1j * motion.frequencies * turned).sum(axis=(1, 2)).real / motion.omega[0]
        return States(np.stack([x, v], axis=1).reshape(1, -1), np.zeros((1, 0)), np.zeros((1, 0)))


def has_torus(problem: Problem) -> bool:
    """Return whether forces, drive and fluid are functions of the motion of the moment: their steady motion is a torus's."""
    remember = any(force.memory or force.switch is not None for force in problem.forces)
    return not (remember or problem.late_fluid or problem.shaken is not None)


def crest(values: Array) -> float:
    """Return the largest value of a function of two phases, by a paraboloid around the largest on the grid."""
    i, j = np.unravel_index(int(np.argmax(values)), values.shape)
    near = values.take(range(i - 1, i + 2), 0, mode="wrap").take(range(j - 1, j + 2), 1, mode="wrap")
    slope = 0.5 * np.array([near[2, 1] - near[0, 1], near[1, 2] - near[1, 0]])
    along, across = near[2, 1] + near[0, 1] - 2.0 * near[1, 1], near[1, 2] + near[1, 0] - 2.0 * near[1, 1]
    mixed = 0.25 * (near[2, 2] - near[2, 0] - near[0, 2] + near[0, 0])
    if not (along < 0.0 and along * across > mixed**2):
        return float(near[1, 1])
    return float(near[1, 1] - 0.5 * slope @ np.linalg.solve([[along, mixed], [mixed, across]], slope))


def share_below(d: Array, level: float) -> float:
    """Return the share of both phases at which a distance is below a level, on straight lines along the first phase."""
    after = np.roll(d, 1, axis=0)
    low, high = np.minimum(d, after), np.maximum(d, after)
    return float(np.clip((level - low) / np.maximum(high - low, 1e-30), 0.0, 1.0).mean())


def curve(
    case: Case, experiment: CurveExperiment, report_progress: Progress, _earlier: xr.Dataset | None
) -> xr.Dataset:
    """Return the locked motions along a curve; see :func:`dforce.runs.carry_out`. A stopped curve is found again as a whole."""
    plan = experiment.plan(case.problem)
    kept, total, done, note = Found.empty(1, len(plan.visits)), len(plan.visits), 0, "free lock"
    tori = TwoTones(case.problem, case.solver, lambda *_: report_progress(min(done, total - 1), total, note))
    with until_stopped() as stop:
        for done, place in enumerate(plan.visits):
            zc = float(plan.values[place[0]])
            note = f"zc = {units.show(zc, 'm', 4)}"
            columns, became = tori.at(zc)
            kept.keep((0, done), columns, became)
        report_progress(total, total, "")
    reference = [tone.frequency for tone in case.problem.tones]
    data = dataset(Layout([plan], plan.coords), [kept], case.problem)
    held = ", ".join(" ".join(tone.lock.held if tone.lock else HELD["am"]) for tone in case.problem.tones)
    data.attrs |= {"protocol": "quasi_static", "reference_frequency": reference, "phases": list(COARSE), "held": held}
    return data.assign_attrs(interrupted=1) if stop.came else data


def at_distance(
    problem: Problem, settings: SolverSettings, zc: float, _harmonics: int, check_cancelled: CancelCheck
) -> tuple[Found, Problem, States]:
    """Return the results at a distance, the problem with the frequencies and drives found there, and the motion."""
    tori, found = TwoTones(problem, settings, check_cancelled), Found.empty()
    columns, became = tori.at(zc)
    found.keep((0, 0), columns, became)
    there, _, motion = tori.last()
    assert motion is not None
    return found, there, States.of(motion)


def at_value(
    cases: Sequence[Case], name: str, value: float, near: Mapping[str, Array]
) -> tuple[dict[str, Array], Bools]:
    """Return the tori of one case on which a quantity of the first tone has a value, and where one was found.

    The way leads from far to the guessed distance, then by the secant method; behind a fold no torus is found. See
    ``locked.at_value`` for the arguments.
    """
    problem, settings = cases[0].problem, cases[0].solver
    return tabled([TwoTones(problem, settings, never_cancelled).meeting(name, value, zc) for zc in near["zc"].tolist()])
