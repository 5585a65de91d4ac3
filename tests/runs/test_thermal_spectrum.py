"""The thermal spectrum as an experiment: its case, its result, its picture, and what it refuses."""

from __future__ import annotations

import asyncio
import functools
import json
import math

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app
from dforce.results.curves import Picture, pictures_of, row_of

CASE = """
title = "A thermal tune"
[cantilever]
modes = [{ f0 = "75 kHz", k = "2.8 N/m", Q = 50 }, { f0 = "470 kHz", k = "110 N/m", Q = 100 }]
[drive]
A0 = "10 nm"
[noise]
detector = "50 fm/Hz^0.5"
seed = 7
[experiment]
kind = "thermal_spectrum"
duration = "60 ms"
"""


@functools.cache
def result() -> xr.Dataset:
    return df.run(df.Case.from_toml(CASE))


def invoke(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def stopped() -> xr.Dataset:
    def stop(done: int, total: int, note: str) -> None:
        if done >= total // 2:
            raise KeyboardInterrupt

    return df.run(df.Case.from_toml(CASE), progress=stop)


def test_the_experiment_and_the_function_are_the_same_run():
    bare = df.Case.from_toml(CASE.split("[experiment]", maxsplit=1)[0])
    assert result().identical(df.thermal_spectrum(bare, "60 ms").assign_attrs(date=result().attrs["date"]))
    assert df.thermal_spectrum(df.Case.from_toml(CASE)).attrs["duration"] == 0.06  # that of the case


def test_the_seed_of_the_case_chooses_the_noise():
    other = df.run(df.Case.from_toml(CASE).replace("noise.seed", 8))
    assert not np.array_equal(other.spectral_density, result().spectral_density)


def test_a_command_runs_draws_and_keeps_it_and_its_file_repeats_it(workdir):
    (workdir / "tune.toml").write_text(CASE, encoding="utf-8")
    done = invoke("run", "tune.toml", "-o", "tune.nc", "--plot", "tune.png")
    assert done.exit_code == 0 and (workdir / "tune.png").stat().st_size > 0
    for words in ("fitted f0 of mode 2", "k of mode 2, by its own calibration", "k, static, 0.817", "k, each mode"):
        assert words in done.stdout
    again = invoke("run", "tune.nc", "-o", "again.nc", "--json")
    assert again.exit_code == 0 and json.loads(again.stdout)["kind"] == "thermal_spectrum"
    assert df.read("again.nc").equals(df.read("tune.nc")) and df.read("tune.nc").equals(result())
    assert invoke("check", "tune.toml").exit_code == invoke("check", "tune.nc").exit_code == 0


def test_the_summary_sets_each_spring_constant_beside_the_true_one():
    found = {one.name: one for one in df.summary(result())}
    for mode in (1, 2):
        true = df.Case.from_toml(CASE).problem.modes[mode - 1].k
        one = found[f"mode_spring_constant_{mode}"]
        assert one.value == result().mode_spring_constant.sel(mode=mode)
        assert f"{one.value / true:.3f} of the true {true:.3g} N/m" in one.text
    names = {f"spring_constant, {name}" for name in result().calibration.values}
    assert len(names) == 4 and names <= set(found)


def test_the_picture_has_logarithmic_axes_and_the_fit_over_the_record():
    [axes] = df.plot.overview(result(), df.plot.Sheet())
    assert axes.get_xscale() == axes.get_yscale() == "log"
    record, fit = axes.lines
    f0 = result().fitted_f0.values
    at = [int(np.argmin(np.abs(result().frequency.values - one))) for one in f0]
    ratio = fit.get_ydata()[at[0]] / fit.get_ydata()[at[1]]
    assert ratio == pytest.approx(float(result().fitted_density[at[0]] / result().fitted_density[at[1]]), rel=1e-12)
    assert len(record.get_ydata()) == result().sizes["frequency"]
    assert all(f"Q = {Q:.3g}" in fit.get_label() for Q in result().fitted_Q.values)
    [drawn] = df.plot.draw(result(), pictures_of(result())[0], df.plot.Sheet())
    assert drawn.get_xscale() == "log"


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"experiment.duration": "1 ms"}, "experiment.duration = 1 ms is too short to resolve the resonance; use"),
        ({"experiment.duration": "1 h"}, "experiment.duration = 3600 s is too long; use at most"),
        ({"noise.thermal": False}, "noise.thermal = false, but a thermal spectrum needs thermal motion"),
    ],
)
def test_a_case_says_at_once_that_there_is_no_such_spectrum(changes, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        for path, value in changes.items():
            df.Case.from_toml(CASE).replace(path, value)


@pytest.mark.parametrize("end", [0, 1])
def test_the_durations_that_a_refusal_names_are_allowed(end):
    case = df.Case.from_toml(CASE)
    with pytest.raises(df.ParameterError) as refused:
        case.replace("experiment.duration", ("1 ms", "1 h")[end])
    words = str(refused.value).removesuffix(" or more").split()
    assert case.replace("experiment.duration", " ".join(words[-2:]))


@pytest.mark.parametrize(("f0", "Q"), [("10 kHz", 20000), ("75 kHz", 200), ("9 MHz", 500)])
def test_what_a_form_suggests_suits_the_lever(f0, Q):
    case = df.Case(cantilever={"f0": f0, "k": "1 N/m", "Q": Q}, drive={"A0": "10 nm"})
    kind = df.experiments.ThermalSpectrum
    assert case.replace(experiment=kind(**kind.suggested(case.problem))).experiment.duration > 0.0


def test_the_solver_of_a_noisy_dwell_does_not_count():
    noisy = df.Case.from_toml(CASE).replace("solver.integrator", "langevin")
    assert df.run(noisy).spectral_density.equals(result().spectral_density)


def test_a_record_that_is_stopped_gives_its_status_alone(workdir, run_as):
    part = stopped()
    assert part.attrs["interrupted"] == 1 and int(part.status) == df.Status.NOT_COMPUTED
    for use in (df.summary, df.plot.overview):
        with pytest.raises(df.ParameterError, match="stopped before its first point"):
            use(part)
    assert df.run(df.Case.from_toml(CASE), resume=part).equals(result())
    (workdir / "tune.toml").write_text(CASE, encoding="utf-8")
    run_as(lambda *given, **settings: part)
    done = invoke("run", "tune.toml", "-o", "tune.nc", "--plot", "tune.png")
    assert done.exit_code == 130 and "nothing was written" in done.stderr
    assert [path.name for path in workdir.iterdir()] == ["tune.toml"]


SIZES = {"youngs_modulus": "169 GPa", "density": 2330, "length": "225 um", "width": "28 um", "thickness": "3 um"}
WET = df.Case(
    cantilever={"beam": SIZES | {"modes": 3}}, medium="water", drive={"A0": "10 nm"}, noise={"seed": 3},
)  # fmt: skip


def test_resonances_that_overlap_in_water_are_told_apart():
    found = df.thermal_spectrum(WET, "0.3 s")
    modes = WET.problem.modes
    # a record tells the mean square of a mode to sqrt(2 Q / omega T), its frequency better
    errors = np.array([math.sqrt(mode.Q / (math.pi * mode.f0 * 0.3)) for mode in modes])
    assert np.all(abs(found.fitted_f0.values / [mode.f0 for mode in modes] - 1.0) < 4.0 * errors)
    assert np.all(abs(found.fitted_Q.values / [mode.Q for mode in modes] - 1.0) < 8.0 * errors)
    assert np.all(abs(found.mode_spring_constant / found.true_mode_spring_constant - 1.0) < 5.0 * errors)


def test_a_mode_below_the_noise_of_the_detector_is_unknown_and_drawn(tmp_path):
    loud = df.thermal_spectrum(WET.replace("noise.detector", "1 nm/Hz^0.5"), "50 ms")
    for name in ("fitted_f0", "fitted_Q", "mode_spring_constant", "spring_constant", "spring_constant_error"):
        assert np.isnan(loud[name]).all(), name
    texts = [one.text for one in df.summary(loud)]
    assert not any("nan" in text for text in texts) and "unknown" in texts
    df.plot.save(df.plot.overview(loud, df.plot.Sheet())[0], tmp_path / "loud.png")
    part = df.thermal_spectrum(
        WET.replace("noise.detector", "0.3 pm/Hz^0.5"), "0.2 s"
    )  # the first mode alone stands out
    assert np.isfinite(part.fitted_f0).values.tolist() == [True, False, False]


def test_the_drive_is_no_matter_of_advice_on_a_free_lever():
    driven = WET.replace("drive.excitation", "base")
    assert {piece.name for piece in df.advice(driven)} >= {"base_in_liquid"}
    tune = driven.replace(experiment=df.experiments.ThermalSpectrum(duration="0.1 s"))
    assert not df.advice(tune) and not df.advice(tune.replace("drive.excitation", "force"))


def test_the_fit_is_drawn_where_something_was_fitted():
    fitted, f = result().fitted_density, result().frequency
    assert np.isfinite(fitted.where(abs(f / 75e3 - 1.0) < 0.2, drop=True)).all()
    assert np.isnan(fitted.where(f < 0.5 * 75e3, drop=True)).all()  # 25 line widths off


def test_the_error_of_a_spring_constant_holds_and_knows_of_the_detector():
    case = df.Case.from_toml(CASE).replace("noise.detector", "0.3 pm/Hz^0.5").replace("experiment.duration", "0.1 s")
    case = case.replace("cantilever.modes", [{"f0": "75 kHz", "k": "2.8 N/m", "Q": 50}])
    runs = [df.run(case.replace("noise.seed", seed)) for seed in range(30)]
    off = [float(np.log(one.spring_constant_ratio.sel(calibration="each mode"))) for one in runs]
    told = float(np.mean([one.spring_constant_error for one in runs]))
    assert 0.6 < np.std(off) / told < 1.4  # of thirty, a standard deviation is told to 13 %
    assert told > 1.3 * math.sqrt(50 / (math.pi * 75e3 * 0.1))  # of the record alone


def test_records_in_a_sweep_over_seeds_are_those_of_single_runs():
    case = df.Case.from_toml(CASE)
    found = df.sweep(case, over={"noise.seed": [1, 2]})
    assert found.spring_constant.dims == ("seed", "calibration")
    for number, seed in enumerate((1, 2)):
        alone = df.run(case.replace("noise.seed", seed))
        np.testing.assert_array_equal(found.spring_constant[number], alone.spring_constant)
    assert (found.spring_constant[0] != found.spring_constant[1]).all()


def test_the_window_shows_it_on_a_logarithmic_scale_and_takes_its_file(tmp_path):
    checks = pytest.importorskip("dforce.gui.files.uploads")
    from simulated import show, window

    from dforce.gui.curves.figures import Layer
    from dforce.gui.curves.panel import Scene

    checks.validate_upload(result(), tmp_path)
    assert pictures_of(result()) == [Picture("frequency", ("spectral_density", "fitted_density"), True, True)]
    assert row_of(result(), "spring_constant") == ""  # a table, no curve

    async def flow():
        async with window(tmp_path, live=False) as (_user, page):
            figure = show(page, result())
            assert [trace["meta"] for trace in figure["data"]] == ["spectral_density", "fitted_density"]
            assert figure["layout"]["yaxis"]["type"] == figure["layout"]["xaxis"]["type"] == "log"
            low, high = (10.0**end for end in figure["layout"]["xaxis"]["range"])
            assert low < 75.0 < 470.0 < high and "(m²/Hz)" in figure["layout"]["yaxis"]["title"]["text"]
            table = page.plots.fit_numbers.sheet
            assert page.plots.pane.current is page.plots.fit_numbers and table.props["rows"] == [
                [one.label, one.text] for one in df.summary(result())
            ]
            page.plots.fit_numbers.show(
                Scene([Layer(result(), "dry"), Layer(result(), "wet")], pictures_of(result())[0])
            )
            assert table.props["heads"] == ["quantity", "dry", "wet"] and len(table.props["rows"][0]) == 3
            [note] = show(page, stopped())["layout"]["annotations"]
            assert (
                "stopped before its first result" in note["text"]
                and page.plots.pane.current is not page.plots.fit_numbers
            )

    asyncio.run(flow())


def test_a_record_that_is_stopped_in_the_window_leaves_no_empty_result_in_the_list(tmp_path, monkeypatch):
    pytest.importorskip("nicegui")
    from simulated import window

    from dforce.gui.document import compute

    monkeypatch.setattr(compute.Job, "compute", lambda job: made)

    async def flow():
        nonlocal made
        async with window(tmp_path, live=False) as (_user, page):
            session = page.view.session
            await session.run(session.document)
            assert session.job.state == "stopped" and len(session.document.results) == 0
            made = result()
            await session.run(session.document)
            assert len(session.document.results) == 1

    made = stopped()
    asyncio.run(flow())


def test_the_spectrum_is_that_of_the_lever_far_from_the_sample():
    near = WET.replace("cantilever.beam.modes", 1).replace("cantilever.beam.tip_height", "10 um")
    far = WET.replace("cantilever.beam.modes", 1)
    assert near.problem.modes[0].Q < 0.8 * far.problem.modes[0].Q  # by the flow between lever and sample
    for wall in ("at_sample", "at_distance"):
        found = df.thermal_spectrum(near.replace("cantilever.beam.wall", wall), "0.2 s")
        assert found.spectral_density.equals(df.thermal_spectrum(far, "0.2 s").spectral_density)
    with pytest.raises(df.ParameterError, match="too short to resolve the resonance"):
        df.thermal_spectrum(near, "1 ms")


@pytest.mark.parametrize("Q", [0.7, 1.0, 2.0])
def test_a_broad_resonance_is_fitted_without_a_shift(Q):
    lever = df.Case(cantilever={"f0": "25 kHz", "k": "0.1 N/m", "Q": Q}, drive={"A0": "10 nm"})
    found = df.thermal_spectrum(lever, "10 s")
    error = math.sqrt(Q / (math.pi * 25e3 * 10.0))  # of the mean square; the frequency is told to about 1 / 2 Q of it
    assert found.fitted_f0.item() == pytest.approx(25e3, rel=5.0 * error / (2.0 * Q))
    assert found.fitted_Q.item() == pytest.approx(Q, rel=6.0 * error)


def test_one_mode_or_calibration_of_it_is_summed_up_and_drawn():
    part = result().sel(mode=2, calibration="each mode")
    found = {one.name: one.value for one in df.summary(part)}
    assert found["fitted_f0"] == part.fitted_f0 and found["spring_constant, each mode"] == part.spring_constant
    axes = df.plot.thermal_spectrum(part, df.plot.Sheet())
    assert f"Q = {float(part.fitted_Q):.3g}" in axes.lines[1].get_label()
