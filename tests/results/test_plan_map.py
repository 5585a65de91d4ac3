"""A plan's map between the values of its grid, and what a result at a set point says of its own gaps."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import dforce as df
from dforce.findings.set_point import states_meant, without_states
from dforce.results.plan_regions import limits_between, nodes

CASE = df.example("figure-4-soft")


@functools.cache
def plan():
    grid = {"start": "4 nm", "stop": "12 nm", "points": 5}
    return df.plan(CASE, {"drive.A0": grid}, {"start": 0.6, "stop": 0.9, "points": 4}, {"max_indentation": "< 5 nm"})


def test_a_map_of_limits_changes_where_the_boundary_was_located():
    x, y, words = limits_between(plan(), "A0", "set_point")
    for A0, share in zip(plan()["edge_A0"].values, plan()["edge_set_point"].values, strict=True):
        row = words[np.argmin(np.abs(y - share))]
        near = {str(row[np.argmin(np.abs(x - by * A0))]) for by in (0.98, 1.02)}
        assert near == {"", "max_indentation"}


def test_a_map_of_limits_keeps_what_was_solved():
    x, y, words = limits_between(plan(), "A0", "set_point")
    allowed = nodes(plan(), "A0", "set_point")[0]
    at = np.ix_(np.searchsorted(y, plan()["set_point"].values), np.searchsorted(x, plan()["A0"].values - 1e-15))
    assert ((words[at] == "") == allowed).all()


def test_values_without_a_state_are_found():
    grid = {"start": "23 nm", "stop": "12 nm", "points": 111}
    case = df.example("hysteresis").replace("experiment.zc", grid)
    states = df.sweep(case, over={"drive.A0": ["20 nm", "40 nm"]}, at_set_point=0.8)
    assert without_states(states).values.tolist() == [False, True]
    with pytest.raises(df.ParameterError, match="no states at a set point"):
        without_states(df.dwell(CASE, zc="20 nm"))


def test_which_states_are_meant_is_said():
    case = df.example("hysteresis")
    both = df.at_set_point(df.approach(case, zc={"start": "23 nm", "stop": "12 nm", "points": 111}))
    assert states_meant(both) == "the states on approach and retract"
    assert "branches" in states_meant(plan())
    assert "branches" in states_meant(df.at_set_point(df.branches(case, zc={"start": "23 nm", "stop": "12 nm"})))
