"""The summary of a result: the right numbers, in words and units that a reader knows."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic

import dforce as df
from dforce.findings import count_status, jumps, number, summary
from dforce.results import Status


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
    assert approach["amplitude_tone1"].text == "1.02 nm to 9.995 nm"
    assert retract["phase_tone1"].text.startswith("5.8544° to ")
    assert approach["max_indentation"].text == "0.22 nm at 7.2 nm"
    assert approach["points"].text == "110 of 111, 2 not settled, 1 failed"
    assert retract["points"].text == "111"


def test_jumps_are_found_where_the_branches_change_places():
    dataset = synthetic.approach(spoiled=False)
    (on_approach,) = jumps(dataset.sel(direction="approach"), "approach")
    (on_retract,) = jumps(dataset.sel(direction="retract"), "retract")
    assert on_approach.at == pytest.approx(7.2e-9)  # the first point after the jump
    assert on_retract.at == pytest.approx(9.7e-9)
    assert on_approach.phase_before > 90.0 > on_approach.phase_after
    assert on_retract.phase_before < 90.0 < on_retract.phase_after


@pytest.mark.parametrize("points", [3, 5, 8, 12, 40, 400])
def test_a_smooth_curve_has_no_jump_however_coarse_its_grid(points):
    dataset = synthetic.approach(points, directions=("approach",), spoiled=False)
    zc, free = dataset.zc.values, 10e-9
    amplitude = np.minimum(zc * 0.98, 0.9999 * free)
    smooth = {"amplitude": (("zc", "tone"), amplitude[:, None])}
    smooth["phase"] = (("zc", "tone"), np.degrees(np.arcsin(amplitude / free))[:, None])
    assert jumps(dataset.assign(smooth)) == []


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
        (2.1798595e-10, "N", "217.99 pN"), (54.2038, "degree", "54.204°"), (0.0, "m", "0"),
        (np.nan, "m", "-"),
        (1e-26, "J", "< 0.001 meV"), (-1e-26, "J", "< 0.001 meV"), (512.0, "1", "512"),
    ],
)  # fmt: skip
def test_numbers_read_well(value, unit, text):
    assert number(value, unit) == text


def test_basins_say_each_state_with_its_share():
    starts = df.basins(df.example("figure-3-basins"), amplitude={"stop": "12 nm", "points": 5}, phase={"points": 8})
    zc, *states = summary(starts)
    assert zc.name == "zc" and zc.value == pytest.approx(9e-9)
    assert sum(state.value for state in states) == pytest.approx(1.0)
    assert all(f"{100 * state.value:.5g} % of the starts, to " in state.text for state in states)
