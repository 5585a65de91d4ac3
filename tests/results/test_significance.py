"""Amounts below their estimated error are "none" wherever a reader sees them; the stored values stay as computed."""

from __future__ import annotations

import functools
import re

import numpy as np
import pytest
from every import every

import dforce as df
from dforce import kernel
from dforce.core.quantities import AMOUNTS
from dforce.findings.summary import summary
from dforce.observables.deviation import DEVIATIONS, deviations
from dforce.results.curves import Picture, goes_along

CONSERVATIVE = [
    name for name in df.examples() if not any(force.dissipative or force.timed for force in df.example(name).forces)
]
LOST = ("total_dissipated_energy", "dissipated_energy", "power")


@functools.cache
def computed(name):
    return df.run(df.example(name))


@pytest.mark.parametrize("detector", ["deflection", "optical_lever", "interferometer"])
@pytest.mark.parametrize("excitation", ["force", "base"])
def test_an_error_estimate_of_1_is_the_error_scale_of_each_amount(excitation, detector):
    # far below resonance a base moves three times as far as the lever bends
    case = df.Case(
        cantilever={"modes": [{"f0": "100 kHz", "k": "0.2 N/m", "Q": 150}, {"f0": "627 kHz", "k": "8 N/m", "Q": 200}]},
        drive={"tones": [{"A0": "1 nm", "frequency": "50 kHz"}, {"A0": "0.3 nm"}], "excitation": excitation},
        readout={"kind": detector}, forces=[],
    )  # fmt: skip
    result, problem = df.dwell(case, zc="9 nm"), case.problem
    numbers, tones = np.array([kernel.parameters(problem, 0.0)]), kernel.tone_table(problem)[None]
    amounts = [name for name in AMOUNTS if name in result and name in DEVIATIONS and "force" not in name]
    assert {"virial", "total_virial", "power", "apparent_dissipated_energy"} < set(amounts)
    for name in amounts:
        here = {one: result[one].values[None] for one in (name, "peak_force", "min_force")}
        there = here | {name: here[name] + result[name].attrs["error_scale"]}
        apart = deviations(problem, numbers, tones, here, there)[0, DEVIATIONS.index(name)]
        assert apart == pytest.approx(1.0, rel=1e-9), name


def test_most_shipped_examples_are_conservative():
    assert len(CONSERVATIVE) > 12 and "figure-5" not in CONSERVATIVE


@pytest.mark.long
@every(CONSERVATIVE)
def test_no_conservative_example_shows_any_dissipated_energy(name):
    result = computed(name)
    for finding in summary(result):
        if finding.name in LOST:
            assert finding.text == "none"
    for piece in df.advice(result):
        assert "dissipates" not in piece.text or "dissipates none" in piece.text


@pytest.mark.parametrize(
    "name", ["figure-3-air", "figure-3-air-jump", "figure-3-water", "hysteresis", "resonance-curve"]
)
def test_the_tables_of_the_window_show_none_for_a_conservative_sample(name):
    pytest.importorskip("nicegui")
    from dforce.gui.curves.figures import Layer, picture
    from dforce.gui.curves.numbers import _blocks, _rows
    from dforce.gui.curves.setpoint import states_of, table_of

    result = computed(name)
    wanted = Picture(goes_along(result), ("total_virial", "total_dissipated_energy"))
    layer = Layer(result, states=states_of(result, 0.8, wanted))
    drawn = picture([layer], wanted)
    lines = [(data["meta"], *what) for data, what in zip(drawn.figure["data"], drawn.traces, strict=True) if what]
    blocks, heads = _blocks(lines, [layer], wanted.x)
    rows = [row for words, block in blocks.items() for row in _rows(words, block, heads[1:])]
    virial, energy = ({row[heads.index(head) + 1] for row in rows} for head in sorted(heads[1:], reverse=True))
    assert energy == {"none"}
    assert len(virial) > 10
    columns, cells = table_of([layer], wanted)
    at = [column.name for column in columns].index("total_dissipated_energy")
    assert {row["cells"][at] for row in cells} == {"none"}


@pytest.mark.parametrize("name", ["figure-2", "figure-6", "table-1-am", "table-1-bimodal"])
def test_the_heading_of_a_table_says_none_and_keeps_the_computed_value(name, tmp_path):
    result = computed(name)
    heading = df.write(result, tmp_path / "dwell.csv").read_text()
    (line,) = re.findall(r"# total_dissipated_energy \(J\) = (.*)", heading)
    assert line.startswith("none")
    assert float(line.rpartition(": ")[2]) == float(result.total_dissipated_energy)
    assert re.search(r"# peak_force \(N\) = \d", heading)


def test_a_motion_that_nothing_repels_has_no_peak_force():
    result = df.run(df.example("figure-7-high").set("experiment.zc.points=16"))
    found = {one.name: one for one in summary(result)}
    assert found["peak_force"].text == "none"
    assert found["peak_force"].value == float(result.peak_force.max()) < 0.0
    assert found["min_force"].text.startswith("-650 pN")


def test_what_a_sample_takes_is_shown_however_small_beside_other_energies():
    case = df.example("figure-5").replace("forces.kelvin_voigt.viscosity", "0.2 Pa s").replace("solver.accuracy", 1e-6)
    found = {one.name: one for one in summary(df.run(case))}
    assert re.fullmatch(r"[\d.]+ meV", found["total_dissipated_energy"].text)


def test_a_shaken_base_misleads_the_usual_formula_alone():
    case = df.example("table-1-am").replace("cantilever.Q", 2.0).replace("drive.excitation", "base")
    (piece,) = [one for one in df.advice(df.run(case)) if one.name == "apparent_dissipation"]
    assert "the sample dissipates none" in piece.text
    assert re.search(r"gives -?[\d.]+ m?eV a period", piece.text)


def test_a_sweep_of_a_conservative_sample_dissipates_nothing():
    case = df.example("figure-3-air-jump").set("experiment.zc.points=56")
    grid = df.sweep(case, over={"drive.A0": ["5 nm", "10 nm"]})
    texts = [one.text for one in summary(grid) if one.name == "total_dissipated_energy"]
    assert texts == ["none", "none"]
    alone = [one.text for one in summary(grid.isel(A0=0)) if one.name == "total_dissipated_energy"]
    assert alone == ["none", "none"]


def test_numbers_stay_as_computed_in_the_result():
    result = computed("figure-3-air")
    assert np.count_nonzero(result.total_dissipated_energy) > 200


@every(CONSERVATIVE)
def test_a_force_curve_of_a_conservative_sample_takes_no_energy(name):
    curve = df.force_curve(df.example(name), distance=np.linspace(2e-9, -1e-9, 101))
    assert [one.text for one in summary(curve) if one.name == "energy"] == ["none"]


def test_a_force_curve_shows_the_energy_that_a_slow_viscous_contact_takes():
    curve = df.force_curve(df.example("figure-5"), distance=np.linspace(2e-9, -1e-9, 101))
    assert [one.text for one in summary(curve) if one.name == "energy"] != ["none"]
