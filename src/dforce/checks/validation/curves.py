"""Curves by sudden steps: an approach and retract of periodic orbits against one of transients."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from dforce.case import Case
from dforce.checks.validation.checks import Check, ValidationPart
from dforce.core.arrays import Array, Bools
from dforce.results.status import Status, whole
from dforce.runs import approach

SAME = 2e-5  # of A0: a transient settles to 1e-6 of A0, and the remainder is larger where multipliers are near one
STEP = 0.1e-9  # m
JUMP = 6.0  # steps of the distance: more than any branch turns in one
TEXT = (
    "An approach and a retract over random cases of DMT and Kelvin–Voigt, in sudden steps of 0.1 nm, once by periodic orbits "
    "and once by transients. The curves agree except beside a jump, which may come one step sooner or later. The area between "
    "approach and retract agrees, too. At a jump the complex amplitude changes by more than six steps of the distance from "
    "one point to the next."
)


def random_case(seed: int, step: float = STEP) -> tuple[Case, Array]:
    """Return a case of DMT, Kelvin–Voigt on top in every second one, and distances in such steps (m) or less."""
    rng = np.random.default_rng(seed)
    A0 = 1e-9 * 10 ** rng.uniform(0.0, 1.0)
    forces: list[dict[str, Any]] = [{"model": "dmt", "hamaker": 10 ** rng.uniform(-20.5, -19.3)}]
    forces.append({"model": "kelvin_voigt", "viscosity": 10 ** rng.uniform(0.0, 2.5) if seed % 2 else 0.0})
    case = Case(
        cantilever={"f0": 60e3, "k": 10 ** rng.uniform(-0.3, 1.3), "Q": 10 ** rng.uniform(0.5, 2.3)},
        drive={"A0": A0},
        tip={"radius": 1e-9 * 10 ** rng.uniform(0.3, 1.3)},
        sample={"youngs_modulus": 10 ** rng.uniform(7.5, 10.0)},
        forces=forces,
    )
    top, bottom = 1.2 * A0 + 1.5e-9, 0.5 * A0
    return case, np.linspace(top, bottom, 2 + int((top - bottom) / step))


def both_ways(case: Case, zc: Array) -> tuple[Any, Any]:
    """Return approach and retract by periodic orbits and by transients."""
    orbits, transients = (
        whole(approach(case.replace("solver.method", method), zc=zc, direction="both", protocol="stepwise"))
        for method in ("periodic", "transient")
    )
    return orbits, transients


def jumps(zc: Array, motion: Any, sound: Bools) -> list[int]:
    """Return the steps between sound points in which the complex amplitude jumps."""
    large = np.abs(np.diff(motion)) > JUMP * np.abs(np.diff(zc))
    return [int(i) for i in np.flatnonzero(large & sound[1:] & sound[:-1])]


@dataclass(frozen=True)
class Agreement:
    """The agreement of two curves: jumps of each, the largest shift of a jump in steps, and the differences.

    `shift` is infinite where the numbers of jumps differ. `apart` is the difference away from jumps, relative to the free
    amplitude. `area` lies between approach and retract, in units of a step times the free amplitude. `sound` is the share of
    points that settled in both.
    """

    jumps: tuple[int, int]
    shift: float
    apart: float
    area: float
    sound: float


def agreement(case: Case, zc: Array) -> Agreement:
    """Compare the two methods along some distances, there and back."""
    orbits, transients = both_ways(case, zc)
    sound = ((orbits.status == Status.OK) & (transients.status == Status.OK)).values
    free = case.problem.tones[0].A0
    curves = [
        (data.amplitude * np.exp(-1j * np.radians(data.phase))).squeeze("tone").values for data in (orbits, transients)
    ]
    apart = np.where(sound, np.abs(curves[0] - curves[1]) / free, 0.0)
    counts, shift, beside = [0, 0], 0.0, np.zeros(apart.shape, dtype=bool)
    for way in range(2):
        each = [jumps(zc, curve[:, way], sound[:, way]) for curve in curves]
        counts = [count + len(places) for count, places in zip(counts, each, strict=True)]
        same = len(each[0]) == len(each[1])
        shift = max([shift, *(abs(a - b) for a, b in zip(*each, strict=True))]) if same else math.inf
        for pair in zip(*each, strict=False):
            beside[max(min(pair) - 1, 0) : max(pair) + 3, way] = True
    loops = [np.where(sound.all(axis=1), np.abs(np.diff(np.abs(curve), axis=1)).ravel(), 0.0).sum() for curve in curves]
    return Agreement(
        (counts[0], counts[1]),
        shift,
        float(np.max(apart[~beside], initial=0.0)),
        abs(loops[0] - loops[1]) / free,
        float(sound.mean()),
    )


def _checks(seed: int) -> Iterator[Check]:
    case, zc = random_case(seed)
    found = agreement(case, zc)
    mode, tone = case.problem.modes[0], case.problem.tones[0]
    words = (
        f"case {seed}: Q = {mode.Q:.3g}, k = {mode.k:.3g} N/m, A0 = {1e9 * tone.A0:.3g} nm, {len(zc)} distances, "
        f"{found.jumps[0]} jumps, {100 * found.sound:.0f} % settled"
    )
    yield Check("shift of a jump, in steps", words, found.shift, None, "1", found.shift, 1.0)
    yield Check("largest difference away from jumps, of A0", words, found.apart, None, "1", found.apart, SAME)
    # each way may hold one jump that comes one step sooner
    yield Check("difference of the hysteresis area, of a step times A0", words, found.area, None, "1", found.area, 2.0)


def part(quick: bool, tell: Callable[[str], None] = lambda text: None) -> ValidationPart:
    """Return this part of the validation."""
    total = 3 if quick else 30
    checks: list[Check] = []
    for seed in range(total):
        if seed % 10 == 0:
            tell(f"curves {seed + 1} to {min(seed + 10, total)} of {total}")
        checks += _checks(seed)
    checks.sort(key=lambda check: check.group)
    return ValidationPart(
        "curves", f"Approach and retract: periodic orbits against transients ({total} cases)", TEXT, tuple(checks), {}
    )
