"""Stability is one decision, with a margin that is the error of the map's derivative."""

import math
from itertools import pairwise

import numpy as np
import pytest
from compiled import CRITICAL, ERROR, FOLD, STABLE, UNSTABLE, Orbit, States, is_stable, stability

from dforce.maps import state_lines
from dforce.maps.loci import LineOrbit
from dforce.solvers import continuation, escape


def lever(Q, turn=0.0):
    """Return the map of a free lever over a period, in which it turns by an angle more than once around."""
    c, s = math.cos(turn), math.sin(turn)
    return math.exp(-math.pi / Q) * np.array([[c, s], [-s, c]])


def beside_fold(aside, Q):
    """Return a map with a multiplier `aside` below 1 and the product that the damping leaves, its directions far apart."""
    first, product = 1.0 - aside, math.exp(-2.0 * math.pi / Q)
    a = 0.5 * (first + product / first) + 0.3
    d = first + product / first - a
    return np.array([[a, 0.7], [(a * d - product) / 0.7, d]])


def nearest_instability(M):
    """Return how far the nearest matrix is that has a multiplier on the unit circle: the distance to instability."""
    values = np.linalg.eigvals(M)
    return min(np.linalg.svd(v / abs(v) * np.eye(len(M)) - M)[1][-1] for v in values)


@pytest.mark.parametrize("Q", [1.0, 100.0, 1e4, 1e6, 1e8])
@pytest.mark.parametrize("turn", [0.0, 1e-9, 0.3, math.pi])
def test_a_free_lever_is_stable_at_any_quality_factor_that_differences_can_tell_from_none(Q, turn):
    rng = np.random.default_rng(1)
    for _ in range(20):
        M = lever(Q, turn) + 0.2 * ERROR * rng.uniform(-1.0, 1.0, (2, 2))
        assert stability(M) == STABLE
        assert is_stable(M)


@pytest.mark.parametrize("Q", [30.0, 255.0, 1e4, 1e5])
def test_a_fold_is_neither_stable_nor_unstable_wherever_its_last_bits_fall(Q):
    rng = np.random.default_rng(2)
    multipliers = []
    for _ in range(50):
        M = beside_fold(0.0, Q) + 0.3 * ERROR * rng.uniform(-1.0, 1.0, (2, 2))
        multipliers.append(np.abs(np.linalg.eigvals(M)).max())
        assert stability(M) == CRITICAL
        assert not is_stable(M)
    assert min(multipliers) < 1.0 < max(multipliers)  # by their multipliers they would be either


@pytest.mark.parametrize("Q", [30.0, 255.0, 1e4])
def test_the_margin_is_the_error_of_the_derivative_whatever_that_does_to_the_multipliers(Q):
    gap = 1.0 - math.exp(-2.0 * math.pi / Q)
    for M, state in ((beside_fold(0.1 * gap, Q), STABLE), (beside_fold(-0.5 * gap, Q), UNSTABLE)):
        assert nearest_instability(M) > 2.0 * ERROR * np.abs(M).max()
        assert stability(M) == state
    for aside in (1e-8, 1e-6, 1e-4, 1e-2, 0.1, 0.3):
        for M in (beside_fold(aside * gap, Q), beside_fold(-aside * gap, Q)):
            room = nearest_instability(M) / (ERROR * np.abs(M).max())
            # the sum over periods bounds the distance within a small factor
            assert room > 1.0 or stability(M) == CRITICAL
            assert room < 5.0 or stability(M) != CRITICAL


@pytest.mark.parametrize("size", [2, 3, 4, 6, 10])
def test_compiled_loops_and_arrays_decide_alike(size):
    rng = np.random.default_rng(size)
    seen = set()
    for _ in range(300):
        M = rng.normal(size=(size, size))
        M *= (1.0 + rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-10.0, 0.0)) / np.abs(np.linalg.eigvals(M)).max()
        assert is_stable(M) == (stability(M) == STABLE)
        seen.add(stability(M))
    assert seen == {STABLE, CRITICAL, UNSTABLE}


@pytest.mark.parametrize("broken", [np.nan, np.inf])
def test_a_map_without_a_number_is_not_stable(broken):
    M = lever(100.0)
    M[0, 1] = broken
    assert stability(M) == UNSTABLE
    assert not is_stable(M)


def test_a_map_that_forgets_everything_is_stable():
    assert stability(np.zeros((2, 2))) == STABLE
    assert is_stable(np.zeros((2, 2)))


# what reads the decision, on a curve of orbits like a parabola: beside its fold, at 0, the multiplier is 1 - 2 x


def orbit(x, special=""):
    monodromy = np.array([[1.0 - 2.0 * x, 0.3], [0.0, 0.5]])
    u = np.array([x, 0.0, x * x])
    kept = States(u[None, :2], np.empty((1, 0)), np.empty((1, 0)))
    return Orbit(u, kept, x * x, kept, monodromy, np.array([1.0, 0.0]), np.empty(0), np.empty(0), 0.0, 0.0, special)


class Parabola:
    """Gives its orbit in the plane through a guess across a vector."""

    def find(self, guess, branch, normal, repeats):
        a, b, c = normal[2], normal[0], -normal @ guess
        roots = [-c / b] if a == 0.0 else np.roots([a, b, c]).real
        return orbit(min(roots, key=lambda x: abs(x - guess[0])))


ASIDE = 1e-10  # of the multiplier from 1: less than its error


@pytest.mark.parametrize("aside", [ASIDE, -ASIDE])
@pytest.mark.parametrize("rounding", [0.0, 4.0 * ASIDE, -4.0 * ASIDE])
def test_an_orbit_within_the_margin_of_a_fold_makes_no_other_special_point(aside, rounding):
    curve = [orbit(x) for x in (0.1, 0.5 * aside, -0.1)]
    curve[1].multipliers[0] += rounding  # which the tangent of the curve does not share
    assert [one.stability for one in curve] == [STABLE, CRITICAL, UNSTABLE]
    found = [point for a, b in pairwise(curve) for point in continuation.bifurcations(Parabola(), a, b)]
    assert [point.special for point in found] == [FOLD]


def test_no_unstable_part_begins_before_the_fold():
    points = [orbit(0.1), orbit(0.5 * ASIDE), orbit(0.0, FOLD), orbit(-0.1)]
    curve = continuation.Curve.of_points(points, 1)
    parts = list(escape._unstable_parts(curve, None))
    assert [(one[0], other[0]) for one, other, _, _ in parts] == [(0.0, -0.1)]


@pytest.mark.parametrize("aside", [ASIDE, -ASIDE])
def test_a_place_within_the_margin_of_a_fold_is_no_boundary_of_another_kind(aside):
    def place(x):
        kept = States(np.array([[x, 0.0]]), np.empty((1, 0)), np.empty((1, 0)))
        return LineOrbit(
            np.array([0.5, x, 0.0, 0.5]),
            kept,
            0.5,
            kept,
            np.array([[1.0 - 2.0 * x, 0.3], [0.0, 0.5]]),
            np.empty(0),
            np.empty(0),
            np.empty(0),
            0.0,
            0.0,
            measured={"virial": 1.0, "min_distance": 1.0},
        )

    class Line:
        def switches_beside(self, last):
            return False

        def find(self, guess, branch, normal, repeats):
            return place(0.0)

    edges = state_lines._edges(Line(), [place(0.1), place(0.5 * aside), place(-0.1)], 0.1)
    assert [kind for kind, found in edges if kind != state_lines.LOST] == [FOLD]
