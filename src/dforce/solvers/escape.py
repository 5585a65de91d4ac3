"""How far stable states are from the nearest unstable one: how fragile they are.

The unstable state at a stable one's value of the parameter lies between two orbits of a curve: on the cubic through both,
along their tangents.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from dforce.core.arrays import Array
from dforce.problem import Problem
from dforce.solvers.continuation import Curve
from dforce.solvers.orbit import Orbit
from dforce.solvers.parameter_range import ParameterRange
from dforce.solvers.stability import CRITICAL, UNSTABLE


class UnstableStates:
    """The unstable states between the orbits of curves, at any value of the parameter."""

    def __init__(self, curves: list[Curve], among: ParameterRange) -> None:
        self._parts = [part for curve in curves for part in _unstable_parts(curve, among)]
        ends = [(one[-1], other[-1]) for one, other, _, _ in self._parts]
        self._ranges = np.sort(np.array(ends).reshape(-1, 2), axis=1)

    def at(self, value: float) -> Array:
        """Return the scaled motions and memories of all unstable states at a scaled value of the parameter, (states, size)."""
        here = np.flatnonzero((self._ranges[:, 0] <= value) & (value <= self._ranges[:, 1]))
        return np.array([u[:-1] for i in here for u in _meet(*self._parts[i], value)])


def escape(orbit: Orbit, unstable: UnstableStates, problem: Problem) -> float:
    """Return how far (m) a stable orbit of a problem is from the nearest unstable one; NaN where there is none.

    It is the largest change, over the modes, of the deflection and of the velocity over the mode's angular frequency, at the
    start of the period.
    """
    others = unstable.at(float(orbit.u[-1])) if orbit.is_stable else ()
    if not len(others):
        return float("nan")
    tone = problem.tones[0]
    ratios = np.array([[1.0, tone.frequency / mode.f0] for mode in problem.modes]).ravel()
    apart = np.abs((others - orbit.x)[:, : len(ratios)] * ratios)
    return float(apart.max(axis=1).min() * tone.A0)


def _unstable_parts(curve: Curve, among: ParameterRange) -> Iterator[tuple[Array, Array, Array, Array]]:
    """Give both ends, and the curve's direction times the distance there, of the parts of a curve that are unstable."""
    points = curve.points
    for one, other in itertools.pairwise(points):
        if {one.stability, other.stability} - {CRITICAL} != {UNSTABLE}:
            continue
        chord = other.u - one.u
        length = float(np.linalg.norm(chord))
        first, last = (length * np.copysign(1.0, end.tangent @ chord) * end.tangent for end in (one, other))
        yield one.u, other.u, first, last
        for turn in range(1, curve.repeats):  # the same motion begun one common period later
            here, there = (_later(end, among, turn) for end in (one, other))
            yield here, there, there - here, there - here


def _later(orbit: Orbit, among: ParameterRange, turns: int) -> Array:
    """Return an orbit's motion and parameter `turns` common periods later."""
    return np.append(among.vectors(among.later(orbit.state, orbit.u[-1], turns))[0], orbit.u[-1])


def _meet(one: Array, other: Array, first: Array, last: Array, value: float) -> Iterator[Array]:
    """Give the points of a part, a cubic, at which the parameter has a value."""
    rise = other - one
    cubic = np.stack([first + last - 2.0 * rise, 3.0 * rise - 2.0 * first - last, first, one])
    polynomial = cubic[:, -1].copy()
    polynomial[-1] -= value
    for root in np.roots(np.trim_zeros(polynomial, "f")):
        if abs(root.imag) < 1e-9 and -1e-9 <= root.real <= 1.0 + 1e-9:
            yield np.polyval(cubic, root.real)
