"""Steps that kick the motion: what can be told without integrating it."""

from __future__ import annotations

import numpy as np

from dforce.solvers import kicks
from dforce.solvers.kicks import REST, leap


def test_a_leap_goes_as_far_as_the_map_where_the_map_is_linear_but_for_a_constant(monkeypatch):
    monkeypatch.setattr(kicks, "mode_count", lambda: 1)
    tangent = 0.999 * np.array([[np.cos(0.02), -np.sin(0.02)], [np.sin(0.02), np.cos(0.02)]])
    orbit, left_out = np.array([0.3, -0.8]), np.array([1e-4, 2e-4])
    motions = [np.array([0.5, -0.6])]
    for _ in range(4 * (REST + 1)):
        motions.append(orbit + tangent @ (motions[-1] - orbit) + left_out)
    motion = motions[REST + 1].copy()
    leap(motions[0], motion, orbit, tangent, 3)
    np.testing.assert_allclose(motion, motions[-1], rtol=0.0, atol=1e-13)
