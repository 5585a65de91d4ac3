"""Every experiment in a sweep: the numbers that it gives alone, whatever way it is stopped, continued and kept."""

import json
import math

import numpy as np
import pytest
from tiers import some_long
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app
from dforce.experiments.base import MotionExperiment
from dforce.maps._one_by_one import unpadded
from dforce.results.kinds import kind_of

CASE = df.example("figure-3-air").replace("cantilever.Q", 50)
PLANS = {
    "dwell": {"kind": "dwell", "zc": "7 nm"},
    "approach": {"kind": "approach", "zc": {"start": "12 nm", "stop": "6 nm", "points": 7}, "direction": "both"},
    "frequency_sweep": {
        "kind": "frequency_sweep", "zc": "8 nm", "frequency": {"start": "47.9 kHz", "stop": "49.9 kHz", "points": 9},
    },
    "branches": {"kind": "branches", "zc": {"start": "12 nm", "stop": "7 nm"}, "search": 2, "largest_step": 0.05},
    "basins": {"kind": "basins", "zc": "8.4 nm", "amplitude": {"stop": "12 nm", "points": 3}, "phase": {"points": 8}},
    "thermal_spectrum": {"kind": "thermal_spectrum", "duration": "0.3 s"},
}  # fmt: skip
OVER = {"forces.dmt.hamaker": ["1e-20 J", "6e-20 J"], "cantilever.Q": [40.0, 255.0]}  # Q 255: two states
SIDE_BY_SIDE = ("dwell", "approach")
LAST = {"hamaker": 1, "Q": 1}
# of each case: a sweep keeps no record, and no time at which one begins
NOT_KEPT = {
    "dwell": {
        "time",
        "deflection",
        "mode_deflection",
        "velocity",
        "distance",
        "force",
        "indentation",
        "frequency",
        "spectrum",
    },
    "thermal_spectrum": {"frequency", "spectral_density", "fitted_density"},
}


@pytest.fixture(scope="module")
def swept():
    """Return the sweep of each experiment, computed once."""
    return {kind: df.sweep(asked(kind), OVER) for kind in PLANS}


def asked(kind):
    return CASE.replace(experiment=PLANS[kind])


def differing(one, other, names):
    """Return the names of variables with other dimensions, numbers or words."""
    return [
        name
        for name in names
        if one[name].dims != other[name].dims
        or not np.array_equal(one[name].values, other[name].values, equal_nan=one[name].dtype.kind == "f")
    ]


def deviation(one, other):
    """Return the largest difference as a share of the largest value."""
    assert (np.isnan(one) == np.isnan(other)).all()
    largest = np.nanmax(np.abs(other), initial=0.0)
    return float(np.nanmax(np.abs(one - other), initial=0.0) / largest) if largest > 0.0 else 0.0


def test_all_experiments_are_held_here():
    assert {*PLANS} == {*df.experiments.EXPERIMENTS}


@pytest.mark.parametrize("kind", PLANS)
def test_numbers_are_the_same_alone_and_in_a_sweep(kind, swept):
    alone = df.run(asked(kind).replace("forces.dmt.hamaker", "6e-20 J").replace("cantilever.Q", 255.0))
    one = unpadded(swept[kind].isel(LAST, drop=True))
    assert {*alone.variables} - {*one.variables} == NOT_KEPT.get(kind, set())
    names = {*alone.variables} & {*one.variables}
    if kind == "dwell":  # the motion itself is kept at the start of the record, which a sweep has none of
        names -= {"motion"}
    if kind == "branches":  # of a case the worst status of its points
        assert int(swept[kind]["status"].isel(LAST)) == int(alone["status"].max())
        names -= {"status"}
    if (
        kind in SIDE_BY_SIDE
    ):  # two orbits that miss their starts by 1e-9, times Q / pi; what is lost is that share of an energy
        names -= {"drift", "error_estimate"}  # these are by how much
        off = {name: deviation(one[name].values, alone[name].values) for name in names if one[name].dtype.kind == "f"}
        losses = {name for name in off if "dissipated" in name or name == "power"}
        assert max(off[name] for name in losses) < (255.0 / math.pi) ** 2 * 1e-9, off
        assert max(off[name] for name in off.keys() - losses) < 1e-6, off
        names = {name for name in names if one[name].dtype.kind != "f"}
    assert differing(one, alone, names) == []
    assert not issubclass(df.experiments.EXPERIMENTS[kind], MotionExperiment) or len(alone.variables) > 25


def test_cases_that_find_more_than_others_are_whole_and_the_others_are_filled_up(swept):
    sizes = {}
    for kind, dim in (("branches", "point"), ("basins", "state"), ("approach", "jump")):
        each = [unpadded(swept[kind].isel(hamaker=i, Q=j)).sizes[dim] for i in range(2) for j in range(2)]
        sizes[kind] = each
        assert max(each) == swept[kind].sizes[dim]
    assert all(len({*each}) > 1 for each in sizes.values()), sizes


def stop_between(done, total, note):
    if 0 < done < total:
        raise KeyboardInterrupt


@pytest.fixture
def often(every_look, cases_a_block, monkeypatch):
    """Let a sweep be looked at often enough to be stopped between two of four short cases."""
    monkeypatch.setattr("dforce.core.parallel.LOOK", 0.001)
    monkeypatch.setattr("dforce.maps._map.LOOK", 0.001)
    cases_a_block(1)


@pytest.mark.parametrize("kind", PLANS)
def test_a_sweep_that_was_stopped_goes_on_to_the_same_result(kind, swept, often):
    part = df.sweep(asked(kind), OVER, workers=1, progress=stop_between)
    assert part.attrs["interrupted"] == 1
    assert (part["status"] == df.Status.NOT_COMPUTED).any()
    whole = df.sweep(asked(kind), OVER, resume=part)
    assert "interrupted" not in whole.attrs
    assert {*whole.variables} == {*swept[kind].variables}
    assert differing(whole, swept[kind], swept[kind].variables) == []


@pytest.mark.parametrize("kind", PLANS)
def test_a_store_holds_the_same_numbers_and_goes_on_after_a_stop(kind, swept, often, tmp_path):
    path = tmp_path / "map.zarr"
    part = df.sweep(asked(kind), OVER, workers=1, progress=stop_between, store=path)
    assert part.attrs["interrupted"] == 1
    whole = df.sweep(asked(kind), OVER, store=path, resume=True).load()
    assert "interrupted" not in whole.attrs
    assert "notes" not in whole.attrs
    assert {*whole.variables} >= {*swept[kind].variables}
    for i, j in np.ndindex(2, 2):  # a store has room for more than any case found
        one, other = (unpadded(data.isel(hamaker=i, Q=j)) for data in (whole, swept[kind]))
        assert differing(one, other, swept[kind].variables) == []


@pytest.mark.parametrize("kind", PLANS)
def test_a_sweep_is_summed_up_drawn_and_written(kind, swept, tmp_path):
    found = swept[kind]
    assert kind_of(found).name == "sweep"
    summary = {one.name: one.text for one in df.summary(found)}
    assert summary["cases"] == "4"
    axes = df.plot.overview(found, df.plot.Sheet())
    assert axes
    assert any(len(line.get_xdata()) for one in axes for line in one.get_lines())
    df.write(found, tmp_path / "sweep.nc")
    back = df.read(tmp_path / "sweep.nc")
    assert differing(back, found, found.variables) == []


@pytest.mark.parametrize("kind", PLANS)
def test_a_sweep_is_explored_in_the_window(kind, swept):
    pytest.importorskip("nicegui")
    from dforce.gui.study import explore, pictures

    found = swept[kind]
    assert explore.is_explorable(found)
    choice = explore.fitting(found, explore.Choice("", "", ""))
    assert {choice.x, choice.y} == {"hamaker", "Q"}
    assert pictures.figure(found, choice)["data"]


@pytest.mark.parametrize("kind", some_long(PLANS, {*PLANS} - {"approach", "basins"}))
def test_the_command_computes_the_same(kind, swept, tmp_path):
    df.save_case(asked(kind).replace(sweep={"over": OVER}), tmp_path / "case.toml")
    out = tmp_path / "out.nc"
    done = CliRunner().invoke(app, ["sweep", str(tmp_path / "case.toml"), "-o", str(out), "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["sizes"]["hamaker"] == 2
    found = df.read(out)
    assert differing(found, swept[kind], swept[kind].variables) == []


def test_quantities_of_any_experiment_can_be_chosen():
    over = {"cantilever.Q": [40.0, 60.0]}
    grid = df.sweep(asked("thermal_spectrum"), over, quantities=["spring_constant"])
    assert {*grid.data_vars} == {"spring_constant", "status"}
    grid = df.sweep(asked("basins"), over, quantities=["share", "amplitude"])
    assert {*grid.data_vars} == {"share", "amplitude", "status"}
    with pytest.raises(df.ParameterError, match="no quantity 'spring_constants'; did you mean"):
        df.sweep(asked("thermal_spectrum"), over, quantities=["spring_constants"])


def test_the_distance_of_experiments_at_one_distance_can_be_swept():
    grid = df.sweep(asked("frequency_sweep"), {"experiment.zc": ["7 nm", "9 nm"]})
    assert grid["amplitude"].dims == ("zc", "frequency", "direction", "tone")
    alone = df.run(asked("frequency_sweep").replace("experiment.zc", "9 nm"))
    np.testing.assert_array_equal(grid["amplitude"][1], alone["amplitude"])


def test_a_case_that_is_not_allowed_says_where_it_is():
    with pytest.raises(df.ParameterError, match=r"^at cantilever.Q = 900: experiment.duration = 300 ms is too short"):
        df.sweep(asked("thermal_spectrum"), {"cantilever.Q": [40.0, 900.0]})


def test_cases_whose_starts_differ_are_refused_with_the_way_out():
    free = CASE.replace(experiment={"kind": "basins", "zc": "9 nm", "phase": {"points": 2}})
    with pytest.raises(df.ParameterError, match="start_amplitude differs from case to case"):
        df.sweep(free, {"drive.A0": ["9 nm", "10 nm"]})
