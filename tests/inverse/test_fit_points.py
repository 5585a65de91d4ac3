"""Which points of a measured curve a fit uses: jumps, the branches between them, and spikes."""

from pathlib import Path

import fitted_curves as fc
import numpy as np
import pytest
import xarray as xr
from fitted_curves import E, H

import dforce as df
from dforce.inverse.checks import doubts
from dforce.inverse.fitting.selection import PointSelection, checked_reading, measured
from dforce.validity import advice_in


def test_points_beside_jumps_are_left_out_and_branches_found_where_they_are_not_named() -> None:
    data = fc.data_of("stiff")
    named, two = (
        df.fit(fc.case_of("stiff"), data, free=[H], search=False, nuisance=["zc_offset"], margin=margin)
        for margin in (None, 2)
    )
    bare = data.drop_vars("branch").assign_coords(direction=("point", np.full(126, "approach")))
    found = df.fit(fc.case_of("stiff"), bare, free=[H], search=False, nuisance=["zc_offset"])
    np.testing.assert_array_equal(found["branch"], data["branch"])
    # a jump that is found may lie a point beside; branches that are named are taken as they are
    assert [one.attrs["points"] for one in (named, found, two)] == [126, 126 - 2, 126 - 4]
    assert (found["used"] >= two["used"]).all()


def test_a_spike_is_no_jump_and_the_report_names_the_points_left_out() -> None:
    data = fc.data_of("stiff")
    bare = data.drop_vars("branch").assign_coords(direction=("point", np.full(126, "approach")))
    place = int(np.argmin(np.abs(bare["height"].values - 15e-9)))
    bare["amplitude"][place] += 5e-9
    settings = {"free": [H], "search": False, "nuisance": ["zc_offset"]}
    fit = df.fit(fc.case_of("stiff"), bare, **settings)
    np.testing.assert_array_equal(fit["branch"], data["branch"])
    assert fit.attrs["points"] == 126 - 2 - 1 and not fit["used"][place]
    beside = np.flatnonzero(fit["left_out"] == "beside a jump")
    told = ", ".join(f"{1e9 * float(bare['height'][one]):.4g} nm" for one in beside)
    line = f"left out: 1 spike at {1e9 * float(bare['height'][place]):.4g} nm; 2 beside a jump at {told}"
    assert len(beside) == 2 and line in df.fit_report(fit).splitlines()
    # branches that are found are no data: the same points are left out once more
    np.testing.assert_array_equal(df.fit_again(fit)["used"], fit["used"])


@pytest.mark.parametrize("free", [50.0, 135.0])
def test_branches_do_not_depend_on_the_phase_of_free_motion(free: float) -> None:
    """A drive with a lag, off resonance or by a base in liquid moves all phases of a curve, the free one, too."""
    data = fc.data_of("stiff")
    bare = data.drop_vars("branch").assign_coords(direction=("point", np.full(126, "approach")))
    shallow = bare.isel(point=bare["phase"].values > 50.0)  # moved by 45 degrees, its repulsive end is above 90
    plain = measured(shallow, PointSelection())
    moved = shallow.assign(phase=shallow["phase"] + (free - 90.0)).assign_attrs(free_phase=free)
    found = measured(moved, PointSelection())
    assert len(np.unique(plain.branch)) == 2
    np.testing.assert_array_equal(found.branch, plain.branch)
    np.testing.assert_array_equal(found.used, plain.used)


@pytest.mark.parametrize("name", ["amplitude", "phase"])
def test_a_spike_at_the_last_point_is_no_jump_and_takes_no_neighbor_along(name: str) -> None:
    data = fc.data_of("stiff")
    bare = data.drop_vars("branch").assign_coords(direction=("point", np.full(126, "approach")))
    last = int(np.argmin(bare["height"].values))
    plain = measured(bare, PointSelection())
    bare[name][last] += {"amplitude": 5e-9, "phase": 20.0}[name]
    found = measured(bare, PointSelection())
    assert np.flatnonzero(plain.used & ~found.used).tolist() == [last] and found.left_out[last] == "spike"
    np.testing.assert_array_equal(found.branch, plain.branch)


def test_a_fit_leaves_out_spikes_that_the_calibration_found_and_does_not_doubt_them() -> None:
    """The first point has a neighbor on one side alone, so a fit by itself takes a spike there for a point."""
    case, draw = fc.case_of("liquid"), np.random.default_rng(2)
    zc = np.linspace(14e-9, 4e-9, 80)
    curve = df.approach(case, zc=zc).isel(tone=0)
    columns = {"height": zc, "amplitude": curve["amplitude"].values, "phase": curve["phase"].values}
    noise = {"amplitude": 0.016e-9, "phase": 0.3}
    for name, size in noise.items():
        columns[name] = columns[name] + size * draw.normal(size=80)
    for place in (0, 55):
        columns["amplitude"][place] += 0.5e-9
    data = xr.Dataset(
        {name: ("point", values) for name, values in columns.items()},
        {"direction": ("point", np.full(80, "approach"))},
        {"phase_convention": "lag", "history": ["read: simulated"]},
    )
    calibrated = df.calibrate(data, case)
    assert sum("has a spike at" in line for line in doubts(calibrated.attrs)) == 2
    fit = df.fit(case, calibrated, free=[E], search=False)
    assert np.flatnonzero(fit["left_out"] == "spike").tolist() == [0, 55]
    assert fit.attrs["points"] == 78 and "doubted_data" not in {one.name for one in advice_in(fit)}
    again = df.fit_again(fit)
    np.testing.assert_array_equal(again["left_out"], fit["left_out"])
    np.testing.assert_allclose(again["value"], fit["value"], rtol=1e-6)


def test_the_report_counts_points_that_were_not_selected() -> None:
    case = fc.case_of("liquid").model_copy(update={"data": df.case.Data(use={"height": ["2 nm", "6 nm"]})})
    fit = df.fit(case, fc.data_of("liquid"), free=[E], search=False, nuisance=["zc_offset"])
    assert f"left out: {91 - fit.attrs['points']} not selected" in df.fit_report(fit)
    assert "left out" not in df.fit_report(fc.result())


def test_jumps_are_sought_among_large_steps_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """A median of all steps at each point takes a time that grows with the square of the points."""
    draw, height, calls = np.random.default_rng(1), np.linspace(40e-9, 20e-9, 3000), []
    amplitude = np.where(height > 30e-9, 30e-9, height - 1e-9) + 6e-11 * draw.normal(size=3000)
    phase = np.where(height > 30e-9, 90.0, 70.0) + 0.3 * draw.normal(size=3000)
    data = fc.dataset(height, amplitude, phase, np.ones(3000), (6e-11, 0.3)).drop_vars("branch")
    median = np.median
    monkeypatch.setattr(np, "median", lambda *args, **how: calls.append(1) or median(*args, **how))
    found = measured(data, PointSelection())
    assert len(calls) < 20
    assert ((found.branch == -1) == (height < 30e-9)).all()


def test_a_jump_of_the_retract_that_is_no_larger_than_steep_steps_is_found_by_that_of_the_approach() -> None:
    height = np.linspace(45e-9, 19e-9, 131)
    attractive = 90.0 + 8.2 * np.exp((32.2e-9 - height) / 0.7e-9)  # up to 98.2 degrees where it ends
    repulsive = 88.2 - 2.4 * np.maximum(32.4e-9 - height, 0.0) / 0.2e-9
    phase = [np.where(height > fold, attractive, repulsive) for fold in (32.1e-9, 32.5e-9)]
    steps = [np.abs(np.diff(one)) for one in phase]
    assert steps[0].max() > 12.0 and steps[1].max() < 8.0  # five times the usual step of 2.4 degrees lies between
    column = fc.dataset(
        np.tile(height, 2), np.tile(height, 2), np.concatenate(phase), np.ones(262), (0.05e-9, 0.05)
    ).drop_vars("branch")
    ways = np.repeat(["approach", "retract"], 131)
    found = measured(column.assign_coords(direction=("point", ways)), checked_reading("measured", None, None, None, ""))
    np.testing.assert_array_equal(
        found.branch, np.where(np.tile(height, 2) > np.repeat([32.1e-9, 32.5e-9], 131), 1, -1)
    )
    assert (~found.used).sum() == 4  # one point to each side of both jumps


def test_a_jump_that_hides_between_two_points_divides_the_curve(tmp_path: Path) -> None:
    # with 25 points each way the jump is no larger than the steep steps beside it
    case = df.Case(
        cantilever={"f0": 300e3, "k": 40.0, "Q": 400}, drive={"A0": 20e-9}, tip={"radius": 8e-9},
        sample={"youngs_modulus": 0.5e9}, forces=[df.forces.DMT(hamaker=8.5e-20)],
    )  # fmt: skip
    loop = df.approach(case, zc=np.linspace(30e-9, 10e-9, 301), direction="both")
    assert loop["jump_zc"].size == 2
    few, draw = np.linspace(0, 300, 25).round().astype(int), np.random.default_rng(1)
    rows = ["height_nm,amplitude_nm,phase_deg"]
    for way, places in (("approach", few), ("retract", few[::-1])):
        one = loop.sel(direction=way).isel(zc=places, tone=0)
        amplitude = one["amplitude"].values * 1e9 + 0.04 * draw.normal(size=25)
        phase = one["phase"].values + 0.3 * draw.normal(size=25)
        rows += [f"{z * 1e9:.3f},{a:.4f},{p:.3f}" for z, a, p in zip(one["zc"].values, amplitude, phase, strict=True)]
    (tmp_path / "curve.csv").write_text("\n".join(rows))
    data = df.calibrate(df.read_measured(tmp_path / "curve.csv", phase_convention="lag"), case)
    behind = measured(data, PointSelection()).branch == -1
    np.testing.assert_array_equal(behind, data["height"] < loop["jump_zc"].values.min())
    fit = df.fit(case.replace(E, 1e9), data, free=[E, H])
    assert fit.attrs["lost_points"] == 0 and not advice_in(fit)
    modulus = fit.sel(parameter=E)
    assert float(modulus["interval_low"]) < 0.5e9 < float(modulus["interval_high"])
    assert float(modulus["error"]) < 0.05 * 0.5e9
