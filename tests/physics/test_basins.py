"""Basins: the states that coexist at a distance, and which start leads to which."""

from __future__ import annotations

import time

import numpy as np
import pytest
import xarray as xr

import dforce as df
from dforce.experiments.basins import starts_of_states
from dforce.procedures.basins import Starts

NM = 1e-9


@pytest.fixture(scope="module")
def figure_3() -> df.Case:
    return df.example("figure-3-air")


@pytest.fixture(scope="module")
def basins(figure_3):
    return df.basins(figure_3, zc="9 nm", amplitude={"stop": "12 nm", "points": 13}, phase={"points": 20})


def test_figure_3_has_an_attractive_and_a_repulsive_state_at_9_nm(basins):
    assert basins.sizes["state"] == 2
    attractive, repulsive = sorted(basins.phase.values[:, 0], reverse=True)
    assert attractive > 90.0 > repulsive
    assert basins.share.sum() == pytest.approx(1.0)
    assert (basins.share.diff("state") <= 0.0).all()
    assert (basins.status == df.Status.OK).all()


def test_the_states_are_those_of_approach_and_retract(figure_3, basins):
    down = df.approach(figure_3, zc=np.linspace(12.0, 9.0, 31) * NM, direction="approach")
    up = df.approach(figure_3, zc=np.linspace(4.0, 9.0, 51) * NM, direction="retract", start="rest")
    curves = [float(curve.amplitude.sel(zc=9 * NM, method="nearest")[0]) for curve in (down, up)]
    # each is an orbit to 1e-9 of the free amplitude, times Q / pi
    np.testing.assert_allclose(np.sort(basins.amplitude.values[:, 0]), np.sort(curves), atol=1e-6 * 10 * NM)


def test_a_start_near_a_state_leads_to_it(basins):
    for state in basins.state.values:
        one = basins.sel(state=state)
        near = {"start_amplitude": float(one.amplitude[0]), "start_phase": float(one.phase[0]) % 360.0}
        assert int(basins.reached.sel(near, method="nearest")) == state


def test_a_state_lies_at_the_motion_of_the_lever_not_at_the_reading(figure_3):
    case = figure_3.replace(
        readout={"kind": "optical_lever", "mode_sensitivity": [1.3], "phase_reference": "free"},
        drive={"A0": "10 nm", "frequency": "48.85 kHz"},
    )
    rest = {"points": 1}
    found = df.basins(
        case,
        zc="9 nm",
        deflection=rest | {"start": "0 nm", "stop": "0 nm"},
        velocity=rest | {"start": 0.0, "stop": 0.0},
    )
    motion = df.motion_at(found.isel(state=0))
    deflection, velocity = starts_of_states(found, case.problem.tones[0])
    assert deflection[0] == pytest.approx(float(motion.mode_deflection[0, 0]), abs=0.01 * 10 * NM)
    assert velocity[0] == pytest.approx(float(motion.velocity[0]), abs=0.01 * float(motion.velocity.max()))


def test_single_dwells_reach_the_states_that_the_picture_shows(figure_3, basins):
    for amplitude, phase in ((5, 8), (2, 0), (10, 3), (8, 12)):
        start = {
            "amplitude": float(basins.start_amplitude[amplitude]),
            "phase": f"{float(basins.start_phase[phase])} deg",
        }
        single = df.dwell(figure_3, zc="9 nm", start=start)
        state = basins.sel(state=int(basins.reached[amplitude, phase]))
        assert float(single.phase[0]) == pytest.approx(float(state.phase[0]), abs=1e-3)


def test_deflection_and_velocity_are_the_same_starts_as_amplitude_and_phase(figure_3):
    omega = 2 * np.pi * 48.9e3
    amplitude, lag = 8 * NM, np.radians(150.0)
    z, v = amplitude * np.cos(lag), amplitude * omega * np.sin(lag)  # of A cos(wt - lag) at time zero
    point = {"points": 1}
    one = df.basins(
        figure_3, zc="9 nm", amplitude={"start": amplitude, "stop": amplitude} | point,
        phase={"start": lag, "stop": lag} | point,
    )  # fmt: skip
    other = df.basins(
        figure_3, zc="9 nm", deflection={"start": z, "stop": z} | point, velocity={"start": v, "stop": v} | point
    )
    assert other.reached.dims == ("start_deflection", "start_velocity")
    assert float(one.phase[0, 0]) == pytest.approx(float(other.phase[0, 0]), abs=1e-6)
    assert float(one.phase[0, 0]) > 90.0


def test_far_away_every_start_leads_to_the_one_state(figure_3):
    far = df.basins(figure_3, zc="40 nm", amplitude={"stop": "12 nm", "points": 3}, phase={"points": 4})
    assert far.sizes["state"] == 1
    assert (far.reached == 1).all()
    assert float(far.share[0]) == 1.0


def test_forces_that_do_not_fit_into_lanes_are_done_one_by_one(figure_3):
    two = figure_3.replace(drive={"tones": [{"A0": "9 nm"}, {"A0": "0.5 nm", "frequency": "97.8 kHz", "mode": 1}]})
    found = df.basins(two, zc="30 nm", amplitude={"stop": "10 nm", "points": 2}, phase={"points": 2})
    assert found.sizes["state"] == 1
    assert found.amplitude.sizes["tone"] == 2


def test_stopping_keeps_the_starts_that_are_done(figure_3):
    def stop(done: int, total: int, note: str) -> None:
        raise KeyboardInterrupt

    found = df.basins(
        figure_3, zc="9 nm", progress=stop, amplitude={"stop": "12 nm", "points": 30}, phase={"points": 30}
    )
    assert found.attrs["interrupted"] == 1
    assert (found.status == df.Status.NOT_COMPUTED).any()
    assert (found.reached.values[found.status == df.Status.NOT_COMPUTED] == 0).all()


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"deflection": {"start": 0.0, "stop": 1e-9}}, "needs both deflection and velocity"),
        (
            {
                "deflection": {"start": 0.0, "stop": 1e-9},
                "velocity": {"start": 0.0, "stop": 1e-3},
                "phase": {"points": 3},
            },
            "write one kind of start",
        ),
        ({"amplitude": {"stop": "10 nm", "points": 4000}, "phase": {"points": 4000}}, "fewer points"),
    ],
)
def test_starts_that_make_no_sense_are_one_sentence(figure_3, settings, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        df.basins(figure_3, zc="9 nm", **settings)


def test_a_case_file_gives_the_same_basins(figure_3, basins):
    text = figure_3.replace(
        experiment=df.experiments.Basins(zc="9 nm", amplitude={"stop": "12 nm", "points": 13}, phase={"points": 20})
    ).to_toml()
    again = df.run(df.Case.from_toml(text))
    np.testing.assert_array_equal(again.reached, basins.reached)


def test_the_picture_names_amplitude_phase_and_share_of_each_state(basins, tmp_path):
    axes = df.plot.overview(basins)[0]
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert len(words) == 2
    assert all("of the starts" in text and "nm" in text and "°" in text for text in words)
    assert df.plot.save(axes, tmp_path / "basins.png").stat().st_size > 5000
    again = df.read(df.write(basins, tmp_path / "basins.nc") or tmp_path / "basins.nc")
    np.testing.assert_array_equal(again.reached, basins.reached)


def test_numbers_do_not_depend_on_the_thread_that_comes_first(monkeypatch):
    case = df.example("figure-3-air").replace("forces.dmt.hamaker", "6e-20 J").replace("cantilever.Q", 100)
    grids = {"amplitude": {"stop": "12 nm", "points": 16}, "phase": {"points": 40}}  # three blocks
    monkeypatch.setattr("dforce.core.parallel.cores", lambda: 1)
    wanted = df.basins(case, "8.4 nm", **grids)
    settle = Starts._settle_with

    def last_first(starts, points, which, *rest):
        if which[0] == 0:
            time.sleep(0.3)
        return settle(starts, points, which, *rest)

    monkeypatch.setattr(Starts, "_settle_with", last_first)
    monkeypatch.setattr("dforce.core.parallel.cores", lambda: 3)
    found = df.basins(case, "8.4 nm", **grids)
    xr.testing.assert_identical(found.assign_attrs(date=""), wanted.assign_attrs(date=""))
