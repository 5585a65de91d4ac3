"""A claim about many cases fails, and names each case that breaks it."""

import pytest
from every import every


def test_a_claim_about_many_cases_names_those_that_break_it():
    @every([(1, 1), (2, 3), (4, "x")])
    def test_pairs_are_equal(a, b):
        assert a + 0 == b + 0

    with pytest.raises(AssertionError, match=r"2 of 3:\n\(2, 3\): AssertionError.*\n*.*\(4, 'x'\): TypeError") as error:
        test_pairs_are_equal()
    assert "(1, 1)" not in str(error.value)


def test_a_claim_about_nothing_is_refused():
    with pytest.raises(AssertionError, match="no case"):
        every([])
