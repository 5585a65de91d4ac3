"""The summary of a result: the right numbers, in words and units that a reader knows."""

from __future__ import annotations

import functools

import numpy as np
import pytest
import synthetic

import dforce as df
from dforce.findings.finding import number
from dforce.findings.jumps import jumps
from dforce.findings.summary import summary
from dforce.results.status import Status, count_status


def by_name(dataset, direction=""):
    return {finding.name: finding for finding in summary(dataset) if finding.direction == direction}


def test_a_dwell_is_summed_up_by_its_scalars():
    found = by_name(synthetic.dwell())
    assert found["amplitude_tone1"].text == "4.05 nm" and found["amplitude_tone1"].value == 4.05e-9
    assert found["phase_tone1"].text == "54.2°"
    assert found["zc"].text == "4 nm"
    assert found["contact_fraction"].text.endswith(" %")
    assert found["total_dissipated_energy"].text.endswith(" eV")


def test_an_approach_is_summed_up_for_each_direction():
    approach, retract = (by_name(synthetic.approach(), way) for way in ("approach", "retract"))
    assert approach["free_amplitude_tone1"].value == pytest.approx(10e-9)
    assert approach["amplitude_tone1"].text == "1.02 nm to 10 nm"
    assert retract["phase_tone1"].text.startswith("5.85° to ")
    assert approach["max_indentation"].text == "0.22 nm at 7.2 nm"
    assert approach["points"].text == "110 of 111, 2 not settled, 1 failed"
    assert retract["points"].text == "111"


def test_points_without_a_state_are_counted_as_such():
    dataset = synthetic.approach(spoiled=False)
    dataset["status"][{"zc": slice(0, 2)}] = df.Status.NO_STATE
    dataset["status"][{"zc": 2}] = df.Status.NOT_REPEATING
    assert by_name(dataset, "approach")["points"].text == "109 of 111, 1 not repeating, 2 without a state"


def test_both_ends_of_a_range_have_the_unit_of_the_larger_one():
    dataset = synthetic.approach(spoiled=False)
    dataset["amplitude"][{"zc": 0}] = 8.1e-12
    assert by_name(dataset, "approach")["amplitude_tone1"].text == "0.0081 nm to 10 nm"


def test_jumps_are_found_where_the_branches_change_places():
    dataset = synthetic.approach(spoiled=False)
    (on_approach,) = jumps(dataset.sel(direction="approach"), "approach")
    (on_retract,) = jumps(dataset.sel(direction="retract"), "retract")
    assert on_approach.at == pytest.approx(7.2e-9)  # the first point after the jump
    assert on_retract.at == pytest.approx(9.7e-9)
    lag = dataset["phase"].isel(tone=0)
    on_the_way_in, on_the_way_out = (lag.sel(direction=way).values for way in ("approach", "retract"))
    assert on_the_way_in[on_approach.before] > 90.0 > on_the_way_in[on_approach.after]
    assert on_the_way_out[on_retract.before] < 90.0 < on_the_way_out[on_retract.after]


@pytest.mark.parametrize("points", [3, 5, 8, 12, 40, 400])
def test_a_smooth_curve_has_no_jump_however_coarse_its_grid(points):
    dataset = synthetic.approach(points, directions=("approach",), spoiled=False)
    zc, free = dataset.zc.values, 10e-9
    amplitude = np.minimum(zc * 0.98, 0.9999 * free)
    smooth = {"amplitude": (("zc", "tone"), amplitude[:, None])}
    smooth["phase"] = (("zc", "tone"), np.degrees(np.arcsin(amplitude / free))[:, None])
    assert jumps(dataset.assign(smooth)) == []


@pytest.mark.parametrize("direction", ["approach", "retract"])
def test_a_curve_in_one_direction_lists_the_jumps_noted_on_it(direction):
    curve = df.run(df.example("figure-3-air-jump").set(f"experiment.direction={direction}"))
    found = by_name(curve)["jumps"]
    assert found.value == curve["jump_zc"].values.tolist() != []
    lags = [float(lag.rstrip("°")) for lag in found.text.split("(")[1].rstrip(")").split(" to ")]
    # in net attraction the lag is above 90°; the tip comes from attraction, and from repulsion on the way out
    assert (lags[0] > 90.0 > lags[1]) == (direction == "approach")


@functools.cache
def sweep():
    case = df.example("figure-3-air-jump").set("experiment.zc.points=56")
    return df.sweep(case, over={"drive.A0": ["5 nm", "10 nm"]})


def test_a_sweep_is_summed_up_by_its_parameters_and_its_extremes_over_all_cases():
    found, of_all = by_name(sweep(), "approach"), by_name(sweep())
    assert of_all["A0"].text == "5 nm, 10 nm" and of_all["A0"].value == [5e-9, 10e-9]
    assert of_all["cases"].value == 2.0
    largest = sweep()["peak_force"].sel(direction="approach")
    assert found["peak_force"].value == float(largest.max())
    at = largest.where(largest == largest.max(), drop=True)
    assert found["peak_force"].text.endswith(f" at A0 = 10 nm, zc = {1e9 * float(at['zc'][0]):.3g} nm")
    # without the energy to reach the sample the small amplitude stays in net attraction
    assert found["jumps"].text == "1 of 2"
    assert found["points"].text == "112"


def test_a_sweep_of_dwells_is_summed_up():
    case = df.example("figure-3-air").replace("experiment", df.experiments.Dwell(zc="8 nm"))
    grid = df.sweep(case, over={"sample.youngs_modulus": np.geomspace(1e9, 4e9, 5)}, quantities=["peak_force"])
    found = by_name(grid)
    assert found["youngs_modulus"].text == "1 GPa ... 4 GPa (5 values)"
    assert found["peak_force"].value == float(grid["peak_force"].max())
    assert "jumps" not in found and "amplitude_tone1" not in found


def test_states_at_a_set_point_are_summed_up_and_cases_without_any_are_named():
    case = df.example("hysteresis").replace("experiment.zc", {"start": "22 nm", "stop": "5 nm", "points": 50})
    states = df.sweep(case, over={"drive.A0": ["6 nm", "36 nm"]}, at_set_point=0.8)
    assert by_name(states)["not_met"].text == "A0 = 36 nm"
    assert by_name(states.isel(A0=0))["min_force"].value == float(states.min_force.min())
    assert by_name(df.at_set_point(df.approach(case)))["peak_force"].value > 0.0


def test_one_case_of_a_sweep_has_the_free_amplitude_of_its_own():
    assert by_name(sweep().isel(A0=0), "approach")["free_amplitude_tone1"].value == pytest.approx(5e-9)


def test_a_curve_without_any_result_can_be_summed_up():
    dataset = synthetic.approach(directions=("approach",))
    dataset = dataset.where(dataset.zc < 0.0)
    dataset["status"] = ("zc", np.full(dataset.sizes["zc"], Status.FAILED, dtype=np.int8))
    found = by_name(dataset)
    assert found["amplitude_tone1"].text == "-" and found["amplitude_tone1"].value is None
    assert found["points"].text == "0 of 111, 111 failed"


def test_a_case_that_this_version_cannot_read_costs_the_free_amplitude_only():
    dataset = synthetic.approach().assign_attrs(case="[canticlever]\nf0 = 1")
    assert "free_amplitude_tone1" not in by_name(dataset, "approach")


def test_a_force_curve_is_summed_up_by_its_extremes():
    found = by_name(synthetic.force_curve(), "retract")
    assert found["min_force"].value == pytest.approx(-3.9e-10, rel=0.1)
    assert " at " in found["min_force"].text


def test_every_status_is_counted():
    assert count_status(synthetic.approach()) == {Status.OK: 219, Status.NOT_SETTLED: 2, Status.FAILED: 1}
    assert count_status(synthetic.dwell()) == {Status.OK: 1}
    assert count_status(synthetic.force_curve()) == {}


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (2.1798595e-10, "N", "218 pN"), (54.2038, "degree", "54.2°"), (0.0, "m", "0"), (1234.5, "N/m", "1230 N/m"),
        (48.8537e3, "Hz", "48.854 kHz"),
        (np.nan, "m", "-"),
        (1e-26, "J", "< 0.001 meV"), (-1e-26, "J", "< 0.001 meV"), (5125.0, "1", "5125"), (0.51257, "1", "0.513"),
    ],
)  # fmt: skip
def test_numbers_read_well(value, unit, text):
    assert number(value, unit) == text


def test_what_was_given_is_shown_with_all_its_digits():
    found = by_name(synthetic.dwell(zc=4.125e-9, amplitude=4.0553e-9))
    assert (found["zc"].text, found["amplitude_tone1"].text) == ("4.125 nm", "4.06 nm")


def test_basins_say_each_state_with_its_share():
    starts = df.basins(df.example("figure-3-basins"), amplitude={"stop": "12 nm", "points": 5}, phase={"points": 8})
    zc, *states = summary(starts)
    assert zc.name == "zc" and zc.value == pytest.approx(9e-9)
    assert sum(state.value for state in states) == pytest.approx(1.0)
    assert all(f"{100 * state.value:.3g} % of the starts, to " in state.text for state in states)
