"""The motion at a point of a result, computed anew."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import dforce as df

ALONG = ("zc", "direction", "frequency", "point", "state")


@functools.cache
def result(name, *settings):
    return df.run(df.example(name).set(*settings))


def points(name, count):
    """Give some points of a result, all over it."""
    dataset = result(name)
    dims = [dim for dim in ALONG if dim in dataset["amplitude"].dims]
    sizes = [dataset.sizes[dim] for dim in dims]
    for flat in np.linspace(0, np.prod(sizes) - 1, count).astype(int):
        yield dataset.isel(dict(zip(dims, np.unravel_index(flat, sizes), strict=True)))


@pytest.mark.parametrize("name", ["figure-3-air-jump", "figure-3-branches", "resonance-curve", "figure-6"])
@pytest.mark.slow
def test_the_motion_has_amplitude_phase_and_forces_of_the_point(name):
    for point in points(name, 15):
        motion = df.motion_at(point)
        A0 = df.example(name).problem.tones[0].A0
        # the traces themselves, over whole common periods; orbits are found anew to 1e-8 of A0 with the curve's own samples,
        # with which a point is as accurate as asked for, or not quite
        frequency = (
            float(point["frequency"]) if name == "resonance-curve" else df.example(name).problem.tones[0].frequency
        )
        turns = np.exp(-2j * np.pi * frequency * motion["time"].values)
        lag = 2.0 * np.mean(motion["deflection"].values * turns)
        wanted = float(point["amplitude"][0]) * np.exp(-1j * np.radians(float(point["phase"][0])))
        assert abs(lag - wanted) < 1e-4 * A0
        # the peak lies between two samples
        assert float(motion["force"].max()) == pytest.approx(float(point["peak_force"]), rel=0.02, abs=1e-12)
        assert float(motion["distance"].min()) == pytest.approx(float(point["min_distance"]), abs=2e-3 * A0)


def test_both_states_at_one_distance_are_shown_as_what_they_are():
    both = result("figure-3-air-jump", "experiment.protocol=stepwise").sel(zc=9.5e-9, method="nearest")
    there, back = (df.motion_at(both.sel(direction=way)) for way in ("approach", "retract"))
    assert float(there["phase"][0]) > 90.0 > float(back["phase"][0])
    assert float(there["indentation"].max()) == 0.0 < float(back["indentation"].max())


def test_an_unstable_state_is_shown_with_a_sentence_that_no_experiment_shows_it():
    dataset = result("figure-3-branches")
    unstable = dataset.isel(point=int(np.flatnonzero(~dataset["stable"].values)[20]))
    motion = df.motion_at(unstable)
    assert "No experiment shows" in motion.attrs["note"]
    assert float(motion["amplitude"][0]) == pytest.approx(float(unstable["amplitude"][0]), rel=1e-6)
    first, second = np.split(motion["deflection"].values, 2)
    # it repeats: what it has gone astray within two periods is far below what can be seen
    np.testing.assert_allclose(first, second, atol=1e-6 * 10e-9)


@pytest.mark.slow
def test_each_state_of_basins_has_its_motion():
    dataset = result("figure-3-basins")
    for n in range(dataset.sizes["state"]):
        motion = df.motion_at(dataset.isel(state=n))
        assert float(motion["phase"][0]) == pytest.approx(float(dataset["phase"][n, 0]), abs=1e-4)


def test_the_motion_of_another_state_is_never_shown():
    point = result("figure-3-air-jump").isel(zc=60, direction=0).copy(deep=True)
    point["amplitude"][0] *= 0.5  # a state that does not exist
    with pytest.raises(df.ResultError, match="another state"):
        df.motion_at(point)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda r: r.isel(direction=0), "choose a point along zc"),
        (lambda r: r.isel(zc=3, direction=0).assign_attrs(case="no"), "does not contain its case"),
        (lambda r: r.isel(zc=3, direction=0).drop_vars("status"), "no motion"),
    ],
)
def test_what_is_no_point_of_a_result_is_refused_in_a_sentence(change, words):
    with pytest.raises(df.ParameterError, match=words):
        df.motion_at(change(result("figure-3-air-jump")))


def test_a_point_without_a_result_says_why():
    point = result("figure-3-air-jump").isel(zc=3, direction=0).copy(deep=True)
    point["status"] = ((), np.int8(df.Status.NOT_COMPUTED))
    with pytest.raises(df.ResultError, match="stopped before this point"):
        df.motion_at(point)


def test_the_motion_of_one_case_of_a_sweep_is_that_of_its_own_parameters():
    case = df.example("figure-3-air").replace("experiment", df.experiments.Dwell(zc="6 nm"))
    grid = df.sweep(case, over={"sample.youngs_modulus": ["1 GPa", "4 GPa"]})
    point = grid.isel(youngs_modulus=1)
    # the largest of 256 samples a period misses the force between them
    assert float(df.motion_at(point)["force"].max()) == pytest.approx(float(point["peak_force"]), rel=0.02)
