"""What the tests of forces share."""

import pytest

from dforce.checks.battery import INSTRUMENT

A0 = INSTRUMENT["contact.a0"]


def same(value, digits=5e-12):
    """Return what equals a reference: by default to the 12 digits that references are given to."""
    return pytest.approx(value, rel=digits, abs=0.0)


@pytest.fixture
def bound():
    """Return a function that binds a force to the typical instrument, with some of its values changed."""

    def bind(force, **changes):
        return force.bind({**INSTRUMENT, **{key.replace("__", "."): value for key, value in changes.items()}})

    return bind


@pytest.fixture
def at(bound):
    """Return a function that gives a force's law at a distance, at rest or moving."""

    def force_at(force, d, rate=0.0, **changes):
        force = bound(force, **changes)
        return force.law_function()(d, rate, 0.0, *force.values())

    return force_at
