"""The exponential that laws are compiled with."""

from __future__ import annotations

import math

import numpy as np
import pytest
from compiled import compile_function

from dforce.forces._exponential import PER_E, exponential, raised


@pytest.fixture(scope="module", params=["interpreted", "compiled"])
def found(request):
    return exponential if request.param == "interpreted" else compile_function(exponential)


@pytest.mark.parametrize("reach", [1e-3, 1.0, 700.0])
def test_the_exponential_is_right_to_the_last_digits_of_its_argument(found, reach):
    x = np.random.default_rng(3).uniform(-reach, reach, 3000)
    values = np.array([found(value) for value in x])
    assert np.all(np.abs(values / np.exp(x) - 1.0) < (3.0 + np.abs(x)) * np.finfo(float).eps)


@pytest.mark.parametrize("compiled", [False, True])
def test_a_power_in_steps_is_right_to_the_last_digits_wherever_it_lies(compiled):
    function = compile_function(raised) if compiled else raised
    steps = np.random.default_rng(4).uniform(-100000.0, 100000.0, 3000)
    values = np.array([function(value, -3.0) for value in steps])
    # 2^x without what rounding of a base or of a product adds: whole powers are exact
    whole = np.floor(steps / 256.0)
    exact = -3.0 * np.ldexp(np.exp2(steps / 256.0 - whole), whole.astype(int))
    assert np.abs(values / exact - 1.0).max() < 4.0 * np.finfo(float).eps
    assert function(PER_E, 1.0) == pytest.approx(math.e, rel=1e-15)


def test_beyond_the_range_of_numbers_it_is_zero_and_infinity(found):
    assert [found(x) for x in (-709.0, -math.inf, 710.0, math.inf, 0.0)] == [0.0, 0.0, math.inf, math.inf, 1.0]
    assert found(-707.5) == pytest.approx(math.exp(-707.5), rel=2e-13)
    assert found(707.5) == pytest.approx(math.exp(707.5), rel=2e-13)
    assert math.isnan(found(math.nan))
