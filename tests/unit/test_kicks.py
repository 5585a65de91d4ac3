"""Steps that kick the motion: what can be told without integrating it."""

from __future__ import annotations

import numpy as np

from dforce.solvers import kicks
from dforce.solvers.kicks import CLEAR, NEAR, REST, has_stayed, leap


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


def test_a_motion_has_stayed_only_when_it_is_nearer_than_it_was_kicked_and_far_from_other_states():
    near, far, calm = 0.9 * NEAR, 1.1 * NEAR, {"before": 0.0, "kicked": 0.01, "most": 0.02, "room": 0.0}
    assert has_stayed(0.004, near * 0.004, **calm)
    assert not has_stayed(0.004, far * 0.004, **calm)
    assert not has_stayed(0.012, near * 0.012, **calm | {"most": 0.05})
    assert not has_stayed(0.008, near * 0.008, **calm | {"most": 0.01})
    # where the map is all but linear and no kink is near, however much of the kick is left
    linear = 0.5 * CLEAR * 0.009
    assert has_stayed(0.009, linear, **calm | {"most": 0.01, "room": 1.0})
    # what the tangent leaves out may pass through zero once
    assert not has_stayed(0.004, near * 0.004, **calm | {"before": far})
    assert not has_stayed(0.009, linear, **calm | {"most": 0.01, "room": 1.0, "before": far})
