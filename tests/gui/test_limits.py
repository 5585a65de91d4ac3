"""What one may ask of a server that others use too."""

from __future__ import annotations

import pytest

import dforce as df
from dforce.gui.window.security import SHARED, Limits


@pytest.mark.parametrize("name", list(df.examples()))
def test_every_example_may_be_computed_on_a_shared_server(name):
    assert SHARED.check(df.example(name)) == df.example(name)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("experiment.zc.points", 100_000),
        ("experiment.zc", [f"{1 + n * 1e-3} nm" for n in range(2001)]),
        ("solver.points_per_period", 65_536),
    ],
)
def test_what_would_fill_a_shared_server_is_refused_in_a_sentence(path, value):
    case = df.example("figure-3-air").replace(path, value)
    assert Limits().check(case) == case
    with pytest.raises(df.ParameterError, match=f"{path} = .* the limit of this server"):
        SHARED.check(case)


@pytest.mark.parametrize("key", ["max_periods", "periods", "measured_periods"])
def test_what_costs_time_alone_is_left_to_the_limit_on_time(key):
    settings = {"method": "transient", "settle": "fixed" if key == "periods" else "converged", key: 50_000}
    case = df.example("table-1-am").replace(solver=settings)
    assert SHARED.check(case) == case
    with pytest.raises(df.ParameterError, match=f"solver.{key} = 50000 is above 2000"):
        SHARED.check(case.replace("experiment.record", "all"))  # each period is kept then
