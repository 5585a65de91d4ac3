"""Motions found for the problems of a block at the values of a parameter: orbits, others, and jumps between them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from dforce.core.arrays import Array, Bools, Indices
from dforce.observables.averaging import weights
from dforce.observables.finish import finish, finish_each, first_amplitude, multipliers
from dforce.solvers.block import Block
from dforce.solvers.integrator import Motion
from dforce.solvers.quasi_static import Stretch
from dforce.solvers.states import States
from dforce.solvers.transient import Steady

OF_ORBIT = ("rows", "monodromy", "residual", "steps", "settling", "error")  # arrays of `Points`
# observables that motions which settled in time do not have, or seldom
ONLY_OF_ORBITS = ("corrections", "multiplier_modulus", "multiplier_angle", "error_estimate")


@dataclass(frozen=True)
class StateJump:
    """A sudden change of state: at which value of the parameter (SI), the amplitudes (m), and whether it was rising.

    `error` is the estimated error of the value, as a share of the parameter's unit; NaN where it is unknown.
    """

    at: float
    before: float
    after: float
    rising: bool
    error: float = np.nan


@dataclass
class Points:
    """The motions found: for each problem and value an orbit, or a steady motion of the single run's kind.

    Attributes
    ----------
    rows, monodromy, residual, steps, settling, error
        Of the orbits, (problems, values, ...); NaN where there is none. `error` is the largest estimated error of a quantity,
        as a share of its scale; see `accuracy`.
    states
        The motion at each point, (problems, values, ...).
    cycles
        After how many common periods the motion repeats; 0 where it does not, -1 where nothing was computed.
    stays
        Whether the error of a motion hardly falls with more samples.
    others
        The other steady motions, by problem and value.
    """

    rows: Array
    monodromy: Array
    residual: Array
    steps: Array
    settling: Array
    error: Array
    states: States
    cycles: Indices
    stays: Bools
    others: dict[tuple[int, int], Steady] = field(default_factory=dict)

    @classmethod
    def empty(cls, block: Block, values: int) -> Points:
        """Return room for `values` values of each problem."""
        shape = (len(block.batch), values)
        inner = ((block.common, block.columns), (block.size, block.size), (), (), (), ())
        rows, monodromy, residual, steps, settling, error = (np.full((*shape, *some), np.nan) for some in inner)
        sizes = (block.size, len(block.memory_scale), block.hysteresis)
        states = States(*(np.full((*shape, size), np.nan) for size in sizes))
        cycles, stays = np.full(shape, -1, dtype=np.int64), np.zeros(shape, dtype=bool)
        return cls(rows, monodromy, residual, steps, settling, error, states, cycles, stays)

    def __getitem__(self, which: slice) -> Points:
        """Return some values of all problems."""
        first, last, _ = which.indices(self.cycles.shape[1])
        arrays = {name: getattr(self, name)[:, which] for name in (*OF_ORBIT, "cycles", "stays")}
        others = {(case, at - first): one for (case, at), one in self.others.items() if first <= at < last}
        return replace(self, **arrays, states=self.states.take((slice(None), which)), others=others)

    def put(self, case: int, place: int, one: Points) -> None:
        """Take over the only point of others."""
        for name in (*OF_ORBIT, "cycles", "stays"):
            getattr(self, name)[case, place] = getattr(one, name)[0, 0]
        self.states.put((case, place), one.states.take((0, 0)))
        if (0, 0) in one.others:
            self.others[case, place] = one.others[0, 0]

    def repeat(self, case: int, places: Indices, new: slice) -> None:
        """Repeat orbits of a problem at other values of it; nothing settles there."""
        for name in ("rows", "monodromy", "residual", "steps", "error", "cycles", "stays"):
            values = getattr(self, name)[case]
            values[new] = values[places]
        self.settling[case, new] = 0.0
        self.states.put((case, new), self.states.take((case, places)))

    def put_other(self, case: int, place: int, found: Steady) -> None:
        """Take a motion that settled in time."""
        self.others[case, place] = found
        self.states.put((case, place), States.of(found.motion).take(0))
        self.cycles[case, place], self.stays[case, place] = 0, found.stays

    def is_settled(self, case: int, place: int) -> bool:
        """Whether the motion at a point has settled, and repeats."""
        found = self.others.get((case, place))
        return bool(self.cycles[case, place] >= 0 and (found is None or (found.settled and found.repeats)))

    def amplitude(self, block: Block, case: int, place: int, value: float) -> float:
        """Return the amplitude (m) at the first tone."""
        found = self.others.get((case, place))
        if found is not None:
            return float(found.values["amplitude"][0])
        return amplitude_of(block, case, value, self.rows[case, place])

    def steady(self, block: Block, case: int, place: int, value: float) -> Steady:
        """Return one point by itself."""
        found = self.others.get((case, place))
        if found is not None:
            return found
        where, motion = (case, place), self.states.take((case, [place])).motion(0)
        numbers = self.settling[where], self.residual[where], self.steps[where]
        values = values_of_orbit(block, case, value, self.rows[where], self.monodromy[where], numbers)
        values["error_estimate"] = float(self.error[where])
        return Steady(values, motion, True, True, block.settings.accuracy, bool(self.stays[case, place]))

    @property
    def is_orbit(self) -> Bools:
        """Whether a point is an orbit of one common period."""
        return np.isfinite(self.residual)

    def columns(self, block: Block, values: Array) -> dict[str, Array]:
        """Return the observables of all points, (problems, values, ...), NaN where there is none, at these values (SI)."""
        shape = self.cycles.shape
        numbers, tones = block.tables(values)
        even = weights(block.frequencies, block.common)
        rows = self.rows.reshape(-1, *self.rows.shape[2:])
        out = finish_each(block.batch.example, block.harmonics, rows, even, numbers, tones)
        modulus, angle = multipliers(self.monodromy.reshape(-1, block.size, block.size))
        out |= {
            "settling_periods": self.settling.flatten(),
            "drift": self.residual.flatten(),
            "corrections": self.steps.flatten(),
            "multiplier_modulus": modulus,
            "multiplier_angle": angle,
            "error_estimate": self.error.flatten(),
        }  # copies, all of them: others are written into them
        out = {name: value.reshape(*shape, *value.shape[1:]) for name, value in out.items()}
        for where, found in self.others.items():
            for name, value in found.values.items():
                out[name][where] = value
        known = np.isfinite(out["corrections"]).any()  # their errors may not be known yet
        kept = {name for name in out if known or name not in ONLY_OF_ORBITS or not np.isnan(out[name]).all()}
        return {name: column for name, column in out.items() if name in kept}


def values_of_orbit(
    block: Block, case: int, value: float, rows: Array, monodromy: Array, numbers: tuple[float, float, float]
) -> dict[str, Any]:
    """Return the observables of an orbit at a value of the parameter.

    `rows` hold the sums over its periods. `numbers` are its settling periods, its drift from the start, and its Newton steps.
    """
    problem, (modulus, angle) = block.integrator(case, value).problem, multipliers(monodromy[None])
    values = finish(problem, block.harmonics, rows, weights(block.frequencies, len(rows)))
    values |= zip(("settling_periods", "drift", "corrections"), map(float, numbers), strict=True)
    return values | {"multiplier_modulus": modulus[0], "multiplier_angle": angle[0]}


def repeated(block: Block, case: int, value: float, found: Stretch, place: tuple[int, int]) -> Steady:
    """Return an orbit found at a value of the parameter, as it was measured over all its periods."""
    numbers = 0.0, found.residual[place], found.steps[place]
    values = values_of_orbit(block, case, value, found.rows[place], found.monodromy[place], numbers)
    row, k = place
    states = States(found.x[row], found.memory[row], found.branch[row])
    return Steady(values, states.motion(k), True, False)


def amplitude_of(block: Block, case: int, value: float, rows: Array) -> float:
    """Return the amplitude (m) at the first tone of an orbit from the measurements over its periods."""
    return first_amplitude(block.integrator(case, value).problem, rows, weights(block.frequencies, len(rows)))


def amplitude_at(block: Block, case: int, motion: Motion, value: float, cycles: int) -> float:
    """Return the amplitude (m) at the first tone of a motion that repeats after `cycles` common periods, at a value."""
    alone = block.one(case)
    slots = alone.slots(States.of(motion), np.array([value]), cycles)
    alone.march(slots, cycles, measured=True)
    return amplitude_of(block, case, value, slots.rows[0])


def as_kept(block: Block, cases: Indices, states: States, at: Array) -> States:
    """Return states rounded as a result in SI keeps them: so a run that goes on from there does as it would have done."""
    scales, base = block.scales_of(cases, at), block.base_of(cases, at)
    return States((states.x - base) * scales / scales + base, states.memory, states.branch)
