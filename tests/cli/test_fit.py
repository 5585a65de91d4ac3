"""`dforce fit`: what it prints and writes, its exit codes, and its sentences."""

import json
from pathlib import Path

import fitted_curves as fc
import pytest
from fitted_curves import E, H
from typer.testing import CliRunner, Result

import dforce as df
from dforce.cli.app import app

CURVES = Path(df.__file__).parent / "library" / "measured"


def ran(*words: object) -> Result:
    return CliRunner().invoke(app, ["fit", *map(str, words)], env={"COLUMNS": "200"})


@pytest.fixture
def case_file(tmp_path: Path) -> Path:
    case = fc.case_of("air").replace(
        title="Air", fit={"free": [H], "search": False}, data={"file": "air.csv", "phase_convention": "lag"}
    )
    df.save_case(case, tmp_path / "fit.toml")
    (tmp_path / "air.csv").write_bytes((CURVES / "air.csv").read_bytes())
    return tmp_path / "fit.toml"


@pytest.mark.slow
def test_a_fit_prints_a_report_and_writes_what_repeats_it(case_file: Path) -> None:
    out, picture = case_file.parent / "out.nc", case_file.parent / "fit.png"
    done = ran(case_file, "-o", out, "--plot", picture)
    assert done.exit_code == 0, done.output
    assert H in done.stdout and "chi2" in done.stdout and f"written: {out}, {picture}" in done.stdout
    assert picture.stat().st_size > 10_000
    again = ran(out)
    assert again.exit_code == 0, again.output
    assert again.stdout.splitlines()[:-1] == done.stdout.splitlines()[:-2] or again.stdout in done.stdout
    # the best case runs as any
    assert CliRunner().invoke(app, ["run", str(out), "-o", str(case_file.parent / "run.nc"), "-q"]).exit_code == 0


def test_json_tells_values_errors_and_advice(case_file: Path) -> None:
    done = ran(case_file, "--json", "--set", f'fit.free=["{E}", "{H}"]')
    assert done.exit_code == 1, done.output  # fitted, with advice
    answer = json.loads(done.stdout)
    assert answer["parameters"][H]["value"] == pytest.approx(1.996e-20, rel=0.02)
    assert answer["parameters"][E]["error"] is None and not answer["parameters"][E]["seen"]
    assert [piece["name"] for piece in answer["advice"]] == ["not_seen"]
    assert answer["exit_code"] == 1


def test_several_files_give_a_table_and_a_bad_one_does_not_stop_it(case_file: Path) -> None:
    good = case_file.parent / "air.csv"
    done = ran(case_file, good, good, case_file.parent / "nowhere.csv", "-o", case_file.parent / "all.nc")
    assert done.exit_code == 1, done.output
    assert "there is no file" in " ".join(done.stdout.split())  # as the terminal wraps it
    many = df.read(case_file.parent / "all.nc")
    assert many.sizes["curve"] == 2
    assert "stopped" not in done.output
    assert float(many["value"].sel(curve=str(good), parameter=H)) == pytest.approx(1.996e-20, rel=0.02)


def test_all_curves_of_one_file_are_fitted(case_file: Path) -> None:
    heading, *rows = [line for line in (CURVES / "air.csv").read_text().splitlines() if not line.startswith("# spec")]
    lines = [f"{heading.removeprefix('# ')},curve", *(f"{row},{number}" for number in (1, 2) for row in rows)]
    table = case_file.parent / "map.csv"
    table.write_text("\n".join([*lines, ""]))
    done = ran(case_file, table, "--json")
    assert json.loads(done.stdout)["curve"] == [f"{table}, curve 1", f"{table}, curve 2"]


@pytest.mark.slow
def test_identify_needs_no_measurement(case_file: Path) -> None:
    (case_file.parent / "air.csv").unlink()
    done = ran(case_file, "--identify", "--json")
    assert done.exit_code == 0, done.output
    answer = json.loads(done.stdout)
    assert answer["parameters"][0] == H and "approach" in answer["curves"]


@pytest.mark.slow
def test_identify_takes_distances_in_shares_too(case_file: Path) -> None:
    case = df.load_case(case_file)
    A0, errors = case.problem.tones[0].A0, []
    for start, stop, more in ((1.15, 0.5, {"of": "drive.A0"}), (1.15 * A0, 0.5 * A0, {})):
        zc = {"start": start, "stop": stop, "points": 21} | more
        df.save_case(case.replace(experiment=df.experiments.Approach(zc=zc)), case_file)
        errors.append(json.loads(ran(case_file, "--identify", "--json").stdout)["error"][0][0][0])
    assert errors[0] == pytest.approx(errors[1], rel=1e-4)  # the lengths differ by roundings


@pytest.mark.long
def test_what_identify_found_is_said_in_words(case_file: Path) -> None:
    assert "an exact instrument" in ran(case_file, "--identify").stdout


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--set", "fit.free=[]"], "must name the parameters"),
        (["nowhere.csv"], "there is no file 'nowhere.csv'"),
        (["a.csv", "b.csv", "--plot", "x.png"], "draws the fit of one curve"),
        (["-o", "fit.txt"], "ends in '.txt'"),
        (["--set", 'data.use={ hight = ["1 nm", "2 nm"] }'], "use has 'hight'"),
    ],
)
def test_bad_input_ends_with_2_and_a_sentence(case_file: Path, words: list[str], sentence: str) -> None:
    done = ran(case_file, *words)
    assert done.exit_code == 2, done.output
    assert sentence in done.stderr and "Traceback" not in done.output


def test_a_case_without_a_fit_is_refused(tmp_path: Path) -> None:
    done = ran("figure-3-air")
    assert done.exit_code == 2
    assert "has no table [fit]" in done.stderr


@pytest.mark.parametrize("named", [True, False])
def test_the_measured_curve_is_never_replaced_by_its_fit(case_file: Path, named: bool) -> None:
    curve = case_file.parent / "air.csv"
    before = curve.read_bytes()
    (case_file.parent / "link.csv").symlink_to(curve)
    for target in (curve, case_file.parent / "link.csv"):
        done = ran(case_file, *([curve] if named else []), "-o", target)
        assert done.exit_code == 2 and "would be lost; write" in " ".join(done.stderr.split()), done.output
    assert curve.read_bytes() == before


def test_all_curves_of_the_file_that_a_case_names_are_fitted(case_file: Path) -> None:
    heading, *rows = [line for line in (CURVES / "air.csv").read_text().splitlines() if not line.startswith("# spec")]
    lines = [f"{heading.removeprefix('# ')},curve", *(f"{row},{number}" for number in (1, 2) for row in rows)]
    (case_file.parent / "air.csv").write_text("\n".join([*lines, ""]))
    done = ran(case_file, "--json")
    assert done.exit_code == 0 and len(json.loads(done.stdout)["curve"]) == 2, done.output


def test_curves_are_told_apart_by_the_numbers_of_their_file(case_file: Path) -> None:
    heading, *rows = [line for line in (CURVES / "air.csv").read_text().splitlines() if not line.startswith("# spec")]
    short = rows[:3]
    parts = ((7, rows), (3, rows), (9, short))
    lines = [f"{heading.removeprefix('# ')},curve", *(f"{row},{number}" for number, part in parts for row in part)]
    table = case_file.parent / "map.csv"
    table.write_text("\n".join([*lines, ""]))
    answer = json.loads(ran(case_file, table, "--json").stdout)
    assert answer["curve"][:2] == [f"{table}, curve 1 (7 in the file)", f"{table}, curve 2 (3 in the file)"]
    assert answer["message"][:2] == ["", ""] and answer["message"][2].startswith("curve 3 (9 in the file) of")
    first, _, last = df.inverse.measured.each_curve(table, {"phase_convention": "lag"})
    assert first.attrs["curve"] == 1 and first.attrs["label"] == "7"
    assert str(last).startswith("curve 3 (9 in the file) of")
