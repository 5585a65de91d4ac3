"""Extremes of the force over the distances that a motion visits: samples in time may pass a narrow crest by.

A motion visits all distances between its closest one and its mean one. Where the force is a function of the distance alone, it
meets each extreme of the law between these two, however fast it passes.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.forces import Force
from dforce.kernel.codegen import CONTACT, parameter_count
from dforce.problem import Problem

FINEST, NARROW = 5e-11, 4e-9  # m; spacing of the distances at which laws are tried, and how far from contact it stays:
GROWTH = 1.015  # farther away it grows. A force between layers of molecules of 0.25 nm is met five times a period
SECTIONS = 40  # of the golden section: to 1e-8 of the spacing
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
SPEED = 1e-3  # m/s: a law that differs at such a speed does not depend on the distance alone
Law = tuple[Callable[..., float], tuple[Any, ...]]  # and its arguments after distance, velocity and time


def passed_by(example: Problem, numbers: Array, zc: Array, measured: dict[str, Array]) -> Array:
    """Return by how much the force has larger extremes on the way than measured, as a share of the largest, (orbits,).

    `numbers` are the kernel's parameters (orbits, parameters), `zc` the average distances (m), `measured` observables by name,
    orbits first.
    """
    missed: Array = np.zeros(len(zc))
    if not all(force.is_of_distance_alone for force in example.forces):
        return missed
    first = parameter_count(len(example.modes), example.late_fluid)
    near, far, a0 = measured["min_distance"], zc + measured["mean_deflection"], numbers[:, CONTACT]
    way = np.flatnonzero(near < far)
    given = np.column_stack([a0, _reach(a0 - near), _reach(far - a0), numbers[:, first:]])[way]
    differs = np.flatnonzero(np.any(given[1:] != given[:-1], axis=1)) + 1  # orbits of one case have the same numbers
    for place, some in zip([0, *differs], np.split(way, differs), strict=True) if len(way) else ():
        a0, inside, outside, *taken = given[place].tolist()
        crests = np.array(crests_of(_laws(example.forces, taken), a0, inside, outside))
        if len(crests):
            d, force = crests.T
            met = (near[some, None] < d) & (d < far[some, None])
            high, low = measured["peak_force"][some, None], measured["min_force"][some, None]
            more = np.where(met, np.maximum(force - high, low - force), 0.0).max(axis=1)
            largest = np.maximum(np.abs([high, low]).max(axis=0), np.where(met, np.abs(force), 0.0)).max(axis=1)
            missed[some] = more / np.where(more > 0.0, largest, 1.0)
    return missed


def _laws(forces: Sequence[Force], numbers: Sequence[float]) -> tuple[Law, ...]:
    """Return the laws of forces with their arguments, from the numbers of all in one row."""
    left, laws = iter(numbers), []
    for force in forces:
        taken = tuple(next(left) if n is None else tuple(next(left) for _ in range(n)) for n in force.layout())
        laws.append((force.law_function(), taken))
    return tuple(laws)


def _reach(distance: Array) -> Array:
    """Return distances (m) rounded up to a power of two, so that the crests of a law are looked for once."""
    return np.exp2(np.ceil(np.log2(np.maximum(distance, FINEST))))


@functools.lru_cache(maxsize=1024)
def crests_of(laws: tuple[Law, ...], a0: float, inside: float, outside: float) -> tuple[tuple[float, float], ...]:
    """Return distances (m) and forces (N) at the local extremes of a sum of laws, up to so far inside and outside contact."""

    def force(d: float, rate: float = 0.0) -> float:
        try:
            return sum(law(d, rate, 0.0, *taken) for law, taken in laws)
        except (ArithmeticError, ValueError):  # beyond the range of the law
            return math.nan

    places = [*(a0 - s for s in _spaced(inside)[::-1]), a0, *(a0 + s for s in _spaced(outside))]
    forces = [force(d) for d in places]
    found = []
    for k in range(1, len(places) - 1):
        for sign in (1.0, -1.0):
            if sign * forces[k - 1] < sign * forces[k] >= sign * forces[k + 1]:
                d = _highest(force, sign, places[k - 1], places[k + 1])
                if force(d, SPEED) == force(d, -SPEED) == force(d):
                    found.append((d, force(d)))
    return tuple(found)


def _spaced(reach: float) -> list[float]:
    """Return distances from contact (m) up to one, ever more apart."""
    even = FINEST * np.arange(1.0, min(reach, NARROW) / FINEST + 1.0)
    steps = max(0, math.ceil(math.log(reach / NARROW, GROWTH)))
    return [*even.tolist(), *(NARROW * GROWTH ** np.arange(1, steps + 1)).tolist()]


def _highest(force: Callable[[float], float], sign: float, low: float, high: float) -> float:
    """Return where sign times a force is largest between two places, by golden section."""
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = sign * force(left), sign * force(right)
    for _ in range(SECTIONS):
        if at_left > at_right:
            high, right, at_right = right, left, at_left
            left = high - GOLDEN * (high - low)
            at_left = sign * force(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + GOLDEN * (high - low)
            at_right = sign * force(right)
    return left if at_left > at_right else right
