"""Each integrator has the order that its description claims, also where the force has kinks, jumps and roots."""

import pytest

from dforce.checks.validation.orders import SLOPES, errors, measured

TO_TOLERANCE = [slope for slope in SLOPES if slope.setting == "relative_tolerance"]


@pytest.mark.parametrize("slope", SLOPES, ids=lambda slope: slope.name)
def test_errors_fall_with_the_order_expected(slope):
    assert slope.lowest < measured(slope) < slope.highest


@pytest.mark.parametrize("slope", TO_TOLERANCE, ids=lambda slope: slope.name)
def test_errors_are_never_far_above_the_tolerance(slope):
    # a period has some hundred steps, and a contact multiplies what they err by
    assert all(error < 1e3 * t for error, t in zip(errors(slope), slope.values, strict=True))


def test_the_engine_reaches_nine_digits():
    assert all(errors(slope)[-1] < 1e-9 for slope in TO_TOLERANCE if slope.integrator == "engine")
