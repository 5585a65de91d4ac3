"""A periodic orbit by SciPy alone: DOP853 over the plain Python laws, Newton's method on its own map.

Of dForce it takes the problem in SI units, the laws as they are written, and a start; nothing that dForce compiles.
Latches change at located events. Kinks and jumps of a law are met by error control: the step shrinks until its error is small.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

from dforce.core.arrays import Array
from dforce.forces import Force
from dforce.problem import Problem

TOLERANCE = 1e-11  # of a step, relative
STEPS = 200  # a period at least: a tap is not stepped over
LOOKS = 6  # instants of a step at which extremes are looked for
HARMONICS = 10
NEAR = 3e-10  # of the free amplitude: distance by which an orbit may miss its start, times the map's amplification
ROUNDS = 12  # Newton steps at most
SHIFT = 1e-5  # of a component's scale, for differences


@dataclass(frozen=True)
class Term:
    """One force: its law, the numbers that it takes, and where its memory and latch lie."""

    law: Callable[..., float]
    force: Force
    leading: tuple[str, ...]
    values: tuple[Any, ...]
    memory: slice
    latch: int


class Lost(ArithmeticError):
    """No orbit was found."""


class Witness:
    """The motion of a problem at one average distance.

    Parameters
    ----------
    problem
        In SI units; without fluid memory and without a lever that changes with height.
    zc
        Average distance (m).
    """

    def __init__(self, problem: Problem, zc: float, rtol: float = TOLERANCE) -> None:
        if problem.late_fluid or problem.heights is not None:
            raise Lost("fluid memory and levers that change with height have no witness")
        self.problem, self.zc, self.rtol = problem, zc, rtol
        self.modes = len(problem.modes)
        self.omega = [2.0 * math.pi * tone.frequency for tone in problem.tones]
        self.phase = [tone.phase for tone in problem.tones]
        self.terms: list[Term] = []
        at, latches = 0, 0
        for force in problem.forces:
            latched = force.switch is not None
            term = Term(
                force.law_function(), force, force.leading(), force.values(), slice(at, at + force.memory),
                latches if latched else -1,
            )  # fmt: skip
            self.terms.append(term)
            at, latches = at + force.memory, latches + latched
        self.memory = at
        length, speed = problem.tones[0].A0, problem.tones[0].A0 * self.omega[0]
        scales = [term.force.memory_scale for term in self.terms for _ in range(term.force.memory)]
        self.scale = np.array([*[length] * self.modes, *[speed] * self.modes, *scales])
        self.length, self.speed = length, speed

    def base(self, t: float) -> tuple[float, float]:
        """Return the base's motion and velocity."""
        turns = [
            moved * complex(math.cos(w * t + p), math.sin(w * t + p))
            for moved, w, p in zip(self.problem.base, self.omega, self.phase, strict=True)
        ]
        return sum(one.real for one in turns), sum(
            (1j * w * one).real for one, w in zip(turns, self.omega, strict=True)
        )

    def force(self, t: float, d: float, rate: float, memory: Array, latches: list[float]) -> float:
        """Return the sum of all laws."""
        total = 0.0
        for term in self.terms:
            latched = latches[term.latch] if term.latch >= 0 else 0.0
            given = {"d": d, "rate": rate, "t": t, "memory": memory[term.memory], "latched": latched, "zc": self.zc}
            total += term.law(*(given[name] for name in term.leading), *term.values)
        return total

    def tip(self, t: float, x: Array) -> tuple[float, float]:
        """Return distance and its rate."""
        moved, speed = self.base(t)
        return self.zc + moved + float(x[: self.modes].sum()), speed + float(x[self.modes : 2 * self.modes].sum())

    def slopes(self, t: float, y: Array, latches: list[float]) -> Array:
        """Return the rates of change of the scaled state and of the integrals behind it."""
        n, size = self.modes, len(self.scale)
        x = y[:size] * self.scale
        d, rate = self.tip(t, x)
        memory = x[2 * n :]
        F = self.force(t, d, rate, memory, latches)
        out = np.empty(len(y))
        out[:n] = x[n : 2 * n]
        turns = [complex(math.cos(w * t + p), math.sin(w * t + p)) for w, p in zip(self.omega, self.phase, strict=True)]
        for i, mode in enumerate(self.problem.modes):
            w0 = 2.0 * math.pi * mode.f0
            push = F + sum((force[i] * turn).real for force, turn in zip(self.problem.drive, turns, strict=True))
            out[n + i] = push * w0 * w0 / mode.k - w0 / mode.Q * x[n + i] - w0 * w0 * x[i]
        change = np.zeros(self.memory)
        for term in self.terms:
            if term.force.memory:
                type(term.force).evolve(d, rate, t, memory[term.memory], change[term.memory], *term.values)
        out[2 * n : size] = change
        out[:size] /= self.scale
        if len(y) > size:
            out[size:] = self.integrands(t, x, rate, F)
        return out

    def integrands(self, t: float, x: Array, rate: float, F: float) -> list[float]:
        """Return the integrands: F, F v, F z, z, then z_n and F at each tone and the total's harmonics."""
        z = x[: self.modes]
        total = float(z.sum())
        row = [F, F * rate, F * total, total]
        for w in self.omega:
            c, s = math.cos(w * t), -math.sin(w * t)
            for value in (*z, F):
                row += [value * c, value * s]
        for k in range(1, HARMONICS + 1):
            row += [total * math.cos(k * self.omega[0] * t), -total * math.sin(k * self.omega[0] * t)]
        return row

    def march(self, x: Array, latches: list[float], seconds: float, look: Look | None = None) -> Array:
        """Return state and integrals after a time; `latches` are changed in place, `look` sees each smooth stretch."""
        size = len(self.scale)
        sizes = self.sizes() if look is not None else np.empty(0)
        y, t = np.concatenate([x / self.scale, np.zeros(len(sizes))]), 0.0
        atol = 1e-2 * self.rtol * np.concatenate([np.ones(size), sizes / self.problem.tones[0].frequency])
        with_latch = [term for term in self.terms if term.latch >= 0]
        while t < seconds * (1.0 - 1e-14):
            found = solve_ivp(
                partial(self.slopes, latches=latches), (t, seconds), y, method="DOP853", rtol=self.rtol, atol=atol,
                events=[self.event(term, latches) for term in with_latch], dense_output=look is not None,
                max_step=1.0 / self.problem.tones[0].frequency / STEPS,
            )  # fmt: skip
            if not found.success:
                raise Lost(found.message)
            if look is not None:
                look.stretch(found.t, found.sol, list(latches))
            t, y = float(found.t[-1]), found.y[:, -1]
            for term, times in zip(with_latch, found.t_events or [], strict=True):
                if len(times):
                    latches[term.latch] = 1.0 - latches[term.latch]
        return np.concatenate([y[:size] * self.scale, y[size:]])

    def sizes(self) -> Array:
        """Return the sizes that errors of the averages are measured by."""
        push = max(1e-30, *(abs(f) for row in self.problem.drive for f in row))
        each = [*[self.length] * (2 * self.modes), push, push] * len(self.omega)
        whole = [push, push * self.speed, push * self.length, self.length]
        return np.array([*whole, *each, *[self.length] * (2 * HARMONICS)])

    def event(self, term: Term, latches: list[float]) -> Callable[[float, Array], float]:
        """Return the function whose rise through zero changes a latch."""
        switch = type(term.force).switch

        def event(t: float, y: Array) -> float:
            d, rate = self.tip(t, y[: len(self.scale)] * self.scale)
            return float(switch(latches[term.latch], d, rate, t, *term.values)) / self.length

        event.terminal, event.direction = True, 1  # type: ignore[attr-defined]
        return event

    def orbit(self, x: Array, latches: list[float], seconds: float) -> Array:
        """Return the state at the start of the periodic orbit near one.

        Raises
        ------
        Lost
            Where Newton's method does not come to an orbit.
        """
        size, before = len(self.scale), math.inf
        x = x.copy()
        for _ in range(ROUNDS):
            image = self.march(x, list(latches), seconds)
            tangent = np.empty((size, size))
            for i in range(size):
                moved = x.copy()
                moved[i] += SHIFT * self.scale[i]
                tangent[:, i] = (self.march(moved, list(latches), seconds) - image) / self.scale / SHIFT
            miss = (image - x) / self.scale
            step = np.linalg.solve(np.eye(size) - tangent, miss)
            x = x + step * self.scale
            here = float(np.abs(step[: 2 * self.modes]).max())
            if here < NEAR or (here < 100.0 * NEAR and here > 0.3 * before):
                return x
            if here > 0.3:
                raise Lost("the start is no orbit")
            before = here
        raise Lost("Newton's method found no orbit")

    def measure(self, x: Array, latches: list[float], seconds: float) -> dict[str, Any]:
        """Return the observables of a periodic motion, by the names of a result, in SI units."""
        look, size, n = Look(self), len(self.scale), self.modes
        mean = self.march(x, list(latches), seconds, look)[size:] / seconds
        pairs = mean[4:].reshape(-1, 2)
        by_tone = 2.0 * (pairs[: len(self.omega) * (n + 1), 0] + 1j * pairs[: len(self.omega) * (n + 1), 1])
        by_tone = by_tone.reshape(len(self.omega), n + 1)
        of_harmonics = 2.0 * pairs[len(self.omega) * (n + 1) :]
        problem, first = self.problem, 1.0 / self.problem.tones[0].frequency
        phases = np.exp(1j * np.array(self.phase))
        weights = np.array(problem.readout.weights)
        read = (by_tone[:, :n] * weights).sum(axis=1) + problem.readout.base * problem.base * phases
        turned = read * np.exp(-1j * np.array(problem.readout.turns)) if problem.readout.turns else read
        own = [next((j for j, tone in enumerate(problem.tones) if tone.mode == i), 0) for i in range(n)]
        of_modes = by_tone[own, range(n)]
        work = by_tone[own, n] * of_modes.conj()
        F, power, virial, z = mean[:4]
        found = {
            "amplitude": np.abs(read),
            "phase": np.degrees(np.mod(np.array(self.phase) - np.angle(turned), 2.0 * math.pi)),
            "mean_deflection": z,
            "mean_force": F,
            "virial": 0.5 * work.real,
            "dissipated_energy": -math.pi * work.imag,
            "total_virial": virial - F * z,
            "total_dissipated_energy": -power * first,
            "contact_fraction": look.contact / seconds,
            **look.extremes(),
        }
        if len(self.omega) == 1:
            found["harmonic_amplitude"] = np.hypot(*of_harmonics.T)
        return found


class Look:
    """Extremes and the time in contact of a motion, stretch by stretch."""

    def __init__(self, witness: Witness) -> None:
        self.witness, self.contact = witness, 0.0
        self.best: dict[str, float] = {}

    def stretch(self, times: Array, sol: Any, latches: list[float]) -> None:
        """Take note of a stretch between two changes of latches."""
        w, a0 = self.witness, self.witness.problem.a0
        grid = np.concatenate([np.linspace(*pair, LOOKS, endpoint=False) for pair in pairwise(times)] + [times[-1:]])

        def distance(t: float) -> float:
            return w.tip(t, sol(t)[: len(w.scale)] * w.scale)[0]

        def rate(t: float) -> float:
            return abs(w.tip(t, sol(t)[: len(w.scale)] * w.scale)[1])

        def force(t: float) -> float:
            x = sol(t)[: len(w.scale)] * w.scale
            return w.force(t, *w.tip(t, x), x[2 * w.modes :], latches)

        d = np.array([distance(t) for t in grid])
        wide = np.flatnonzero((d[1:] < a0) != (d[:-1] < a0))
        edges = [grid[0], *(brentq(lambda t: distance(t) - a0, grid[i], grid[i + 1]) for i in wide), grid[-1]]
        self.contact += sum(b - a for a, b in pairwise(edges) if distance(0.5 * (a + b)) < a0)
        for name, sign, function in (
            ("min_distance", -1.0, distance), ("peak_velocity", 1.0, rate),
            ("peak_force", 1.0, force), ("min_force", -1.0, force),
        ):  # fmt: skip
            values = sign * np.array([function(t) for t in grid])
            i = int(values.argmax())
            low, high = grid[max(i - 1, 0)], grid[min(i + 1, len(grid) - 1)]
            found = minimize_scalar(
                lambda t, f=function, s=sign: -s * f(t), bounds=(low, high), method="bounded",
                options={"xatol": 1e-9 * (high - low)},
            )  # fmt: skip
            here = max(float(values[i]), -float(found.fun))
            self.best[name] = max(self.best.get(name, -math.inf), here)

    def extremes(self) -> dict[str, float]:
        """Return the extremes with their signs."""
        return {name: -value if name.startswith("min") else value for name, value in self.best.items()}
