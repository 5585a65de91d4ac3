"""Comparisons of small numbers can fail."""

import pytest


def test_energies_of_a_tap_that_differ_are_not_approximately_equal():
    assert pytest.approx(2e-19, rel=1e-6) != 1e-19
