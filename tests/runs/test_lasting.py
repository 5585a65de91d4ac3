"""Motions that have not settled: which of them stay as they are, and over how many periods they are measured."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from dforce.observables import measure
from dforce.solvers.transient import _lasting

TOLERANCE = 1e-4
K = np.arange(256)


def looked_at(c, count=8):
    """Return whether a motion stays whose amplitude in each period is given, and how many periods of it are measured."""
    rows = np.zeros((len(c), measure.FIRST + 6))
    rows[:, measure.FIRST + 2], rows[:, measure.FIRST + 3] = np.real(c), np.imag(c)
    problem = SimpleNamespace(modes=[None], tones=[SimpleNamespace(frequency=1.0)])
    integrator = SimpleNamespace(problem=problem, settings=SimpleNamespace(settle_tolerance=TOLERANCE))
    lasts, measured, _ = _lasting(integrator, rows, count, 1, 1.0)
    return lasts, len(measured)


def test_a_slow_drift_is_no_subharmonic_motion():
    # two periods make less than the tolerance, all of them more than a hundred times that
    assert looked_at(0.5 + 0.45 * TOLERANCE * K) == (False, 8)


@pytest.mark.parametrize(("n", "count", "periods"), [(2, 8, 256), (7, 250, 256), (7, 300, 300), (60, 250, 256)])
def test_a_subharmonic_motion_is_measured_over_whole_cycles_however_many_periods_there_are(n, count, periods):
    lasts, measured = looked_at(0.5 + 0.05 * np.cos(2.0 * np.pi * np.arange(periods) / n), count)
    assert lasts
    assert measured % n == 0
    assert abs(measured - count) < n + periods % n


@pytest.mark.parametrize("decay", [30, 100, 300])
def test_a_motion_that_rings_down_has_not_settled_however_far_it_wanders(decay):
    assert looked_at(0.5 + 0.05 * np.exp((0.7j - 1.0 / decay) * K)) == (False, 8)


def test_a_motion_that_turns_without_end_stays_although_it_never_repeats():
    golden = np.pi * (np.sqrt(5.0) - 1.0)
    assert looked_at(0.5 + 0.05 * np.exp(1j * golden * K)) == (True, 256)
