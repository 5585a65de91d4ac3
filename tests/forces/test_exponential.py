"""The exponential that laws are compiled with."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dforce.forces._exponential import exponential
from dforce.kernel.link import compile_function


@pytest.fixture(scope="module", params=["interpreted", "compiled"])
def found(request):
    return exponential if request.param == "interpreted" else compile_function(exponential)


@pytest.mark.parametrize("reach", [1e-3, 1.0, 700.0])
def test_the_exponential_is_right_to_the_last_digits(found, reach):
    x = np.random.default_rng(3).uniform(-reach, reach, 3000)
    values = np.array([found(value) for value in x])
    assert np.abs(values / np.exp(x) - 1.0).max() < 3.0 * np.finfo(float).eps


def test_beyond_the_range_of_numbers_it_is_zero_and_infinity(found):
    assert [found(x) for x in (-709.0, -math.inf, 710.0, math.inf, 0.0)] == [0.0, 0.0, math.inf, math.inf, 1.0]
    assert found(-707.0) == pytest.approx(math.exp(-707.0), rel=1e-15)
    assert found(708.5) == pytest.approx(math.exp(708.5), rel=1e-15)
    assert math.isnan(found(math.nan))
