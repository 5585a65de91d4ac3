"""The regime map: boundaries against folds and approaches, and its picture."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib import pyplot as plt

import dforce as df
from dforce.findings import others

STIFF = df.Case(
    cantilever=df.Cantilever(f0="70 kHz", k="2.7 N/m", Q=180.0),
    drive=df.Drive(A0="30 nm"),
    tip=df.Tip(radius="8 nm"),
    sample=df.Sample(youngs_modulus="2 GPa", poisson_ratio=0.3),
    forces=[df.forces.DMT(hamaker="6e-20 J"), df.forces.KelvinVoigt(viscosity="20 Pa s")],
)


@pytest.fixture(scope="module")
def stiff():
    fold = 23.19851349508282 / 30.0  # amplitude of the attractive fold at A0 = 30 nm, by df.branches
    over = {"drive.A0": {"start": "24 nm", "stop": "40 nm", "points": 9}}
    return df.regimes(STIFF, over, [fold, 0.8])  # four lines of orbits: some ten seconds


def edge(found, kind: str, j: int) -> float:
    share = float(found.set_point[j])
    (value,) = found.edge_A0.values[(found.edge_kind == kind) & np.isclose(found.edge_set_point, share)]
    return float(value)


def test_a_boundary_passes_through_the_fold_of_the_branches(stiff):
    # the fold of the curve of orbits at A0 = 30 nm: 23.1020453 nm, phase 129.32637 degrees
    at = (stiff.edge_kind == "fold") & np.isclose(stiff.edge_set_point, float(stiff.set_point[0]))
    # at the accuracy of 1e-4 that is asked for
    assert float(stiff.edge_A0.values[at][0]) == pytest.approx(30e-9, rel=2e-5, abs=0.0)
    assert float(stiff.edge_zc.values[at][0]) == pytest.approx(23.1020453e-9, rel=2e-5, abs=0.0)
    assert float(stiff.edge_phase.values[at][0]) == pytest.approx(129.32637, abs=1e-3)


def test_attractive_states_end_where_only_the_repulsive_one_was_met(stiff):
    # approaches on a grid of 3 nm met the repulsive state alone from 31 nm on
    assert 28.0 < 1e9 * edge(stiff, "end", 1) < 31.0


def test_cells_agree_with_the_boundaries(stiff):
    words = stiff.regime.attrs["flag_meanings"].split()
    for j in (0, 1):
        of_share = np.array(words)[stiff.regime.values[:, j]]
        beyond = stiff.A0.values > edge(stiff, "end", j)
        assert set(of_share[beyond]) == {"repulsive"}
        assert set(of_share[~beyond]) == {"both"}
    assert (stiff.states.values == np.where(stiff.regime == words.index("both"), 2, 1)).all()


def test_every_point_of_a_line_is_an_operating_point(stiff):
    choose = np.linspace(0, stiff.sizes["point"] - 1, 7).astype(int)
    ratio = stiff.line_amplitude / stiff.line_A0
    np.testing.assert_allclose(ratio, stiff.line_set_point, atol=1e-8)
    for i in choose:
        if not bool(stiff.line_stable[i]):
            continue
        case = STIFF.replace("drive.A0", float(stiff.line_A0[i]))
        start = {"amplitude": float(stiff.line_amplitude[i]), "phase": np.radians(float(stiff.line_phase[i]))}
        dwell = df.dwell(case, zc=float(stiff.line_zc[i]), start=start)
        assert float(dwell.amplitude[0]) == pytest.approx(float(stiff.line_amplitude[i]), rel=1e-4)
        assert float(dwell.phase[0]) == pytest.approx(float(stiff.line_phase[i]), abs=0.02)


def test_the_map_is_a_picture_with_its_boundaries(stiff):
    axes = df.plot.map(stiff, "A0", "set_point", "regime")
    words = {text.get_text() for text in axes.get_legend().get_texts()}
    assert {"both", "repulsive", "a state ends"} <= words
    assert any(line.get_xdata().size == 2 for line in axes.lines)
    plt.close("all")


def test_a_map_is_kept_in_a_file(stiff, tmp_path):
    df.write(stiff, tmp_path / "map.nc")
    back = df.read(tmp_path / "map.nc")
    np.testing.assert_array_equal(back.edge_A0, stiff.edge_A0)
    df.plot.map(back, "A0", "set_point", "regime")
    plt.close("all")


def test_a_map_over_two_parameters_has_the_boundaries_of_each_row():
    over = {"drive.A0": {"start": "26 nm", "stop": "36 nm", "points": 6}, "cantilever.Q": [150.0, 180.0]}
    both = df.regimes(STIFF, over, [0.8])
    assert both.regime.dims == ("A0", "Q")
    ends = both.edge_A0.values[(both.edge_kind == "end") & (both.edge_Q == 180.0)]
    alone = df.regimes(STIFF, {"drive.A0": over["drive.A0"]}, [0.8])
    wanted = alone.edge_A0.values[alone.edge_kind == "end"]
    np.testing.assert_allclose(ends, wanted, rtol=1e-6)
    df.plot.map(both, "A0", "Q", "regime")
    plt.close("all")


@pytest.mark.parametrize(
    ("over", "sentence"),
    [
        ({"drive.A": ["1 nm", "2 nm"]}, "did you mean 'drive.A0'"),
        ({"drive.A0": ["1 nm"]}, "a map needs a range"),
        ({"drive.A0": ["1 nm", "2 nm"], "tip.radius": ["1 nm", "2 nm"]}, "over two parameters is at one set point"),
        ({"solver.method": ["periodic", "transient"]}, "is not a plain number"),
    ],
)
def test_a_mistake_is_one_sentence(over, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        df.regimes(STIFF, over)


SOFT = STIFF.replace(
    forces=[
        df.forces.VanDerWaals(hamaker="6e-20 J"),
        df.forces.SLSSimple(instant_modulus="3 GPa", relaxed_modulus="1 GPa"),
    ]
)
STICKY = STIFF.replace(forces=[df.forces.Hertz(), df.forces.AdhesionHysteresis()])
NECK = STIFF.replace(forces=[df.forces.DMT(hamaker="6e-20 J"), df.forces.Capillary(volume="5 nm^3")])
JUMPING = STIFF.replace(forces=[df.forces.JKR(surface_energy="20 mJ/m^2", hamaker="6e-20 J")])


def around(case, A0: float, share: float):
    """Return the map at one set point over 4 nm around a free amplitude (nm)."""
    return df.regimes(case, {"drive.A0": {"start": f"{A0 - 2} nm", "stop": f"{A0 + 2} nm", "points": 3}}, [share])


def approach_past(case, found, kind: str):
    """Return an approach past a boundary in steps of 1e-4 A0, and by how many A0 each distance is above the boundary."""
    [i] = np.flatnonzero(found.edge_kind == kind)
    A0, zc = float(found.edge_A0[i]), float(found.edge_zc[i])
    above = np.concatenate([np.arange(1.3 - zc / A0, 2e-3, -0.005), 1e-4 * np.arange(10.5, -8.0, -1.0)])
    return df.approach(case.replace("drive.A0", A0), zc=zc + A0 * above, harmonics=1), above


def test_a_boundary_of_a_force_with_memory_passes_through_the_fold_of_the_branches():
    # the fold of the curve of orbits at A0 = 28 nm, by df.branches: 20.5522134 nm, phase 132.630486 degrees
    found = around(SOFT, 28.0, 0.735587236)
    [i] = np.flatnonzero(found.edge_kind == "fold")
    assert float(found.edge_A0[i]) == pytest.approx(28e-9, rel=2e-5, abs=0.0)
    assert float(found.edge_zc[i]) == pytest.approx(20.5522134e-9, rel=2e-5, abs=0.0)
    assert float(found.edge_phase[i]) == pytest.approx(132.630486, abs=1e-3)
    assert (found.states.values[0], found.states.values[-1]) == (2, 1)


@pytest.mark.parametrize(
    ("case", "A0", "share"), [(STICKY, 27.0, 0.78), (SOFT, 28.0, 0.735587236)], ids=["switch", "memory"]
)
def test_an_approach_jumps_at_the_fold_of_the_map(case, A0, share):
    curve, above = approach_past(case, around(case, A0, share), "fold")
    jump = int(np.argmax(np.abs(np.diff(curve.phase.values[:, 0]))))
    assert above[jump + 1] < 0.0 < above[jump] or np.abs(above[jump : jump + 2]).min() < 1e-4


def test_a_state_grazes_at_the_free_amplitude_at_which_its_branch_does():
    # the branch at A0 = 24 nm grazes at this share, by df.branches
    found = around(JUMPING, 24.0, 0.934327446)
    assert edge(found, "grazing", 0) == pytest.approx(24e-9, rel=2e-5, abs=0.0)
    assert set(found.edge_kind.values.tolist()) == {"grazing", "contact"}


@pytest.mark.parametrize(
    ("case", "A0", "share", "samples"),
    [(JUMPING, 24.0, 0.93, 512), pytest.param(NECK, 6.0, 0.8, 2048, marks=pytest.mark.long)],
)
def test_a_state_of_two_branches_ends_where_an_approach_no_longer_settles(case, A0, share, samples):
    """Of fewer samples the lowest point lies deeper between two; curves beside a neck take more, maps do not."""
    case = case.replace("solver.points_per_period", samples)
    curve, above = approach_past(case, around(case, A0, share), "grazing")
    settles = curve.status.values == 0
    assert abs(above[settles].min()) < 1e-4
    assert settles[above > 1e-4].all()


@pytest.mark.long
def test_a_boundary_of_a_row_of_elements_passes_through_the_fold_of_its_branches():
    sls = df.forces.SLS(instant_modulus="3 GPa", relaxed_modulus="1 GPa", elements=8)
    case = STIFF.replace(forces=[df.forces.VanDerWaals(hamaker="6e-20 J"), sls])
    states = df.branches(case.replace("drive.A0", "28 nm"), zc=("33.6 nm", "14 nm"), harmonics=1)
    fold = states.isel(point=int(np.flatnonzero(states.special == "fold")[0]))
    found = around(case, 28.0, float(fold.amplitude[0]) / 28e-9)
    [i] = np.flatnonzero(found.edge_kind == "fold")
    assert float(found.edge_A0[i]) == pytest.approx(28e-9, rel=2e-5, abs=0.0)
    assert float(found.edge_zc[i]) == pytest.approx(float(fold.zc), rel=2e-5, abs=0.0)


def test_the_summary_counts_the_settings_without_steady_state():
    states = ("A0", "set_point"), np.array([[0, 0, 1], [1, 2, 1]])
    found = {one.name: one.text for one in others.regimes(xr.Dataset({"states": states}))}
    assert found["without_state"].startswith("2 of 6")
    assert "without_state" not in {one.name for one in others.regimes(xr.Dataset({"states": ("A0", [1, 2])}))}


@pytest.mark.parametrize("row", [1, 2])
def test_a_stopped_map_has_its_finished_rows(row):
    def stop(done, total, note):
        if note == f"row {row}":
            raise KeyboardInterrupt

    case = df.example("figure-3-air")
    found = df.regimes(case, {"drive.A0": ["8 nm", "10 nm"]}, [0.6, 0.8], progress=stop)
    assert found.attrs["interrupted"] == 1 and found.sizes["set_point"] == row - 1
    if row == 1:
        with pytest.raises(df.ParameterError, match="stopped before its first row"):
            df.summary(found)
    else:
        assert (found.states > 0).all()
        assert "without_state" not in {one.name for one in df.summary(found)}


def test_a_state_that_loses_its_stability_just_below_a_set_point_is_on_the_map():
    """The curves, with steps of 0.1 nm, met it at no point: the last stable one is above, the next one does not repeat."""
    case = df.Case(
        cantilever={"f0": "11.75 kHz", "k": "0.151 N/m", "Q": 4.86}, drive={"A0": "8.4 nm"}, tip={"radius": "24.3 nm"},
        sample={"youngs_modulus": "3.64 GPa", "poisson_ratio": 0.3}, forces=[df.forces.DMT(hamaker="53.6 zJ")],
    )  # fmt: skip
    curve = df.approach(case, zc=["9 nm", "8.3 nm", "8.2 nm"])
    assert (curve.status == 0).all() and curve.amplitude_ratio[-1] < 0.889 < curve.amplitude_ratio[-2]
    found = df.regimes(case, {"drive.A0": ["8.4 nm", "8.6 nm"]}, [0.889])
    assert found.states.values.ravel().tolist() == [1, 0]
    assert found.edge_kind.values.tolist() == ["instability"]
