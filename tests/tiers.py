"""Which of several like tests wait for `make validate`: those that compile much, or take long, beside others that are run."""

from __future__ import annotations

from collections.abc import Iterable

import pytest


def some_long(names: Iterable[str | int], long: Iterable[str | int]) -> list[object]:
    """Return parameters of a test by name, some of them marked as long."""
    given, later = list(names), set(long)
    assert later < set(given), "a name that no test has, or no test that is left"
    return [pytest.param(name, marks=pytest.mark.long) if name in later else name for name in given]
