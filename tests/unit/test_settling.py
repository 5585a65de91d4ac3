"""How far states are apart from each other."""

import numpy as np

from dforce.solvers.settling import apart


def test_states_without_end_are_infinitely_far_apart_and_nobody_is_warned():
    a = np.array([[0.1, 0.2], [np.inf, 0.0], [np.nan, 0.0]])
    b = np.array([[0.1, 0.5], [np.inf, 0.0], [0.0, 0.0]])
    np.testing.assert_allclose(apart(a, b), [0.3, np.inf, np.inf])
