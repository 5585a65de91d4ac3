"""A sweep that was stopped goes on to the result of one that was not."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

import dforce as df
from dforce.core.parallel import Crew

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

CURVE = df.experiments.Approach(zc={"start": "18 nm", "stop": "6 nm", "points": 17}, direction="both")
NUMBERS = {"sample.youngs_modulus": ["3 GPa", "0.5 GPa", "1 GPa"], "drive.A0": ["15 nm", "17 nm"]}
AROUND_A_CHOICE = {
    "sample.youngs_modulus": ["1 GPa", "3 GPa"], "solver.method": ["periodic", "transient"], "drive.A0": ["15 nm", "17 nm"],
}  # fmt: skip
A_CASE = 34  # points: there and back


def case(**changes: object) -> df.Case:
    values = {
        "cantilever": df.Cantilever(f0="50 kHz", k=1.0, Q=100.0),
        "drive": df.Drive(A0="15 nm"),
        "tip": df.Tip(radius="5 nm"),
        "sample": df.Sample(youngs_modulus="1 GPa"),
        "forces": [df.forces.DMT(hamaker="3e-20 J")],
        "experiment": CURVE,
    }
    return df.Case(**values | changes)


@pytest.fixture
def stopped(
    every_look: None, cases_a_block: Callable[[int], None], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., xr.Dataset]:
    """Return a function that sweeps with two cases side by side and is stopped once so many points are done."""
    cases_a_block(2)
    add = Crew.add

    def sweep(points: int, *args: Any, **settings: Any) -> xr.Dataset:
        def add_and_wait(crew: Crew, count: int) -> None:
            add(crew, count)
            if crew.done >= points and threading.current_thread() is not threading.main_thread():
                assert crew._stopped.wait(20.0)

        def stop(done: int, total: int, note: str) -> None:
            if done >= points:
                raise KeyboardInterrupt

        with monkeypatch.context() as patch:
            patch.setattr(Crew, "add", add_and_wait)
            return df.sweep(*args, workers=1, progress=stop, **settings)

    return sweep


def whole_cases(part: xr.Dataset) -> xr.DataArray:
    return (part.status != df.Status.NOT_COMPUTED).all(["zc", "direction"])


def assert_same(found: xr.Dataset, wanted: xr.Dataset) -> None:
    xr.testing.assert_identical(found.assign_attrs(date=""), wanted.assign_attrs(date=""))


OVER = {"numbers": NUMBERS, "a choice": AROUND_A_CHOICE}


@functools.cache
def undisturbed(name: str, method: str) -> xr.Dataset:
    """Return the sweep that nothing stops."""
    return df.sweep(case(solver={"method": method}), OVER[name], workers=1)


@pytest.mark.parametrize(
    ("name", "method", "points"),
    [
        ("numbers", "periodic", 1), ("numbers", "periodic", 185), ("a choice", "periodic", 150),
        *(
            pytest.param(*one, marks=pytest.mark.long)
            for one in (
                ("numbers", "periodic", 0), ("numbers", "periodic", 50), ("numbers", "transient", 50),
                ("numbers", "transient", 203),
                ("a choice", "periodic", 50), ("a choice", "periodic", 255),
            )
        ),
    ],
)  # fmt: skip
def test_a_stopped_sweep_goes_on_to_the_result_of_one_that_was_not(name, method, points, stopped, tmp_path):
    curves, over = case(solver={"method": method}), OVER[name]
    whole, part = undisturbed(name, method), stopped(points, curves, over)
    assert part.attrs["interrupted"] == 1 and int((part.status != df.Status.NOT_COMPUTED).sum()) >= points
    assert whole.jump_zc.notnull().any()
    df.write(part, tmp_path / "part.nc")
    told = []
    rest = df.sweep(
        curves, over, workers=1, progress=lambda *at: told.append(at[:2]), resume=df.read(tmp_path / "part.nc")
    )
    assert_same(rest, whole)
    assert told[0] == (A_CASE * int(whole_cases(part).sum()), whole.status.size)
    assert told[-1] == (whole.status.size, whole.status.size)


@pytest.mark.parametrize("points", [0, 20, 50, 67])
def test_a_stopped_sweep_of_cases_run_one_by_one_goes_on(points, stopped):
    curves = case(solver={"settle": "fixed", "periods": 50, "method": "transient"})
    over = {"sample.youngs_modulus": [1e9, 3e9]}
    part = stopped(points, curves, over)
    assert int((part.status != df.Status.NOT_COMPUTED).sum()) == points
    assert_same(df.sweep(curves, over, resume=part), df.sweep(curves, over))


def test_a_case_that_is_begun_anew_has_no_values_where_it_is_not_computed(stopped):
    curves = case(solver={"settle": "fixed", "periods": 50, "method": "transient"})
    over = {"sample.youngs_modulus": [1e9, 3e9]}
    part = stopped(A_CASE + 5, curves, over, resume=stopped(A_CASE + 16, curves, over))
    computed = part.status != df.Status.NOT_COMPUTED
    assert computed.sum(["zc", "direction"]).values.tolist() == [A_CASE, 5]
    np.testing.assert_array_equal(part.amplitude.notnull().isel(tone=0), computed)


def test_a_stopped_sweep_over_the_distance_of_a_dwell_goes_on(stopped):
    dwell = case(experiment=df.experiments.Dwell(zc="14 nm"), solver={"method": "transient"})
    over = {"experiment.zc": ["10 nm", "12 nm", "14 nm"], "drive.A0": ["15 nm", "17 nm"]}
    part = stopped(1, dwell, over)
    assert 0 < int((part.status == df.Status.OK).sum()) < 6
    assert_same(df.sweep(dwell, over, workers=1, resume=part), df.sweep(dwell, over, workers=1))


def test_cases_that_are_whole_are_not_computed_again(stopped):
    part = stopped(120, case(), NUMBERS)
    done = whole_cases(part)
    assert 0 < int(done.sum()) < done.size
    marked = part.assign(amplitude=part.amplitude.where(~done, 1.0))
    rest, whole = df.sweep(case(), NUMBERS, workers=1, resume=marked), df.sweep(case(), NUMBERS, workers=1)
    xr.testing.assert_equal(rest.amplitude, whole.amplitude.where(~done, 1.0))


def test_a_sweep_may_be_stopped_again_and_loses_nothing(stopped):
    first = stopped(150, case(), AROUND_A_CHOICE)
    assert (whole_cases(first) != (first.status == df.Status.OK).any(["zc", "direction"])).any()  # one in its middle
    second = stopped(0, case(), AROUND_A_CHOICE, resume=first)
    assert_same(second, first)
    third = stopped(220, case(), AROUND_A_CHOICE, resume=second)
    assert int(whole_cases(third).sum()) > int(whole_cases(first).sum())
    assert np.isnan(third.amplitude.values[third.status == df.Status.NOT_COMPUTED]).all()
    assert_same(
        df.sweep(case(), AROUND_A_CHOICE, workers=1, resume=third), df.sweep(case(), AROUND_A_CHOICE, workers=1)
    )


@pytest.mark.parametrize("kept", [["amplitude", "jump_before"], ["jump_direction", "phase"], ["amplitude"], []])
def test_a_stopped_sweep_goes_on_with_the_quantities_that_it_kept(kept, stopped):
    part = stopped(150, case(), NUMBERS, quantities=kept)
    assert_same(
        df.sweep(case(), NUMBERS, workers=1, resume=part), df.sweep(case(), NUMBERS, workers=1, quantities=kept)
    )
    with pytest.raises(df.ParameterError, match="keeps other quantities"):
        df.sweep(case(), NUMBERS, quantities=["drift"], resume=part)


@pytest.mark.parametrize(
    ("over", "sentence"),
    [
        (NUMBERS | {"drive.A0": ["15 nm", "16 nm"]}, "other values of drive.A0"),
        (NUMBERS | {"drive.A0": ["15 nm"]}, "other values of drive.A0"),
        (NUMBERS | {"drive.A0": ["17 nm", "15 nm"]}, "other values of drive.A0"),
        (
            dict(reversed(NUMBERS.items())),
            "over sample.youngs_modulus, drive.A0, so .* drive.A0, sample.youngs_modulus",
        ),
        ({"drive.A0": ["15 nm", "17 nm"]}, "over sample.youngs_modulus, drive.A0, so"),
    ],
)
def test_a_sweep_goes_on_over_the_same_values_only(over, sentence, stopped):
    part = stopped(0, case(), NUMBERS)
    with pytest.raises(df.ParameterError, match=sentence):
        df.sweep(case(), over, resume=part)


def test_a_sweep_that_was_cut_does_not_go_on(stopped):
    part = stopped(0, case(), NUMBERS)
    for cut, name in (({"zc": slice(3)}, "zc"), ({"direction": 0}, "direction"), ({"A0": 0}, "drive.A0")):
        with pytest.raises(df.ParameterError, match=f"other values of {name}"):
            df.sweep(case(), NUMBERS, resume=part.isel(cut))


def test_choices_are_compared_as_they_were_given(stopped):
    over = {"solver.points_per_period": [64, 128]}
    part = stopped(0, case(), over)
    with pytest.raises(df.ParameterError, match=r"other values of solver\.points_per_period"):
        df.sweep(case(), {"solver.points_per_period": [64, 256]}, resume=part)


def test_only_an_unfinished_sweep_of_the_same_case_goes_on(stopped):
    over = {"drive.A0": ["15 nm", "17 nm"]}
    whole, part = df.sweep(case(), over), stopped(0, case(), over)
    assert df.sweep(case(), over, resume=whole) is whole
    with pytest.raises(df.ParameterError, match="another case; load its own by"):
        df.sweep(case().replace("cantilever.k", "2 N/m"), over, resume=part)
    with pytest.raises(df.ParameterError, match="not a sweep"):
        df.sweep(case(), over, resume=df.run(case()))
    with pytest.raises(df.ParameterError, match=r"df.sweep\(case, over=..., resume=...\) continues it"):
        df.run(case(), resume=part)
