"""The commands: what they print, write and return, with runs made by formulas."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import synthetic
from every import every
from tiers import some_long
from typer.testing import CliRunner

import dforce as df
from dforce.cli._streams import plain
from dforce.cli.app import app
from dforce.results.status import count_status
from dforce.validity import attributes

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

CASE = synthetic.CASE + '\n[experiment]\nkind = "approach"\nzc = { start = "12 nm", stop = "1 nm", points = 111 }\n'


def invoke(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture
def here(workdir):
    """A folder of its own with a case file in it."""
    (workdir / "case.toml").write_text(CASE, encoding="utf-8")
    return workdir


@pytest.fixture
def ran(run_as):
    """Replace the computation; remember what was asked for."""
    calls = []

    def give(make):
        def run(case, progress=None, resume=None):
            calls.append({"case": case, "resume": resume})
            progress(1, 2, "zc = 5 nm")
            return make().assign_attrs(title=case.title, case=case.to_toml())

        run_as(run)
        return calls

    return give


def interrupted(done=40):
    dataset = synthetic.approach(directions=("approach",), spoiled=False)
    dataset["status"][done:] = df.Status.NOT_COMPUTED
    return dataset.assign_attrs(interrupted=1)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_run_writes_a_result_and_a_picture_and_says_what_was_found(here, ran):
    ran(lambda: synthetic.approach(spoiled=False))
    done = invoke("run", "case.toml", "-o", "out.nc", "--plot", "figure.png")
    assert done.exit_code == 0 and done.stderr == ""
    assert names(here) == ["case.toml", "figure.png", "out.nc"]
    lines = done.stdout.splitlines()
    assert lines[0] == "Synthetic, in air" and lines[1].split() == ["approach", "retract"]
    assert re.search(r"^phase lag +5\.85° to ", done.stdout, re.MULTILINE)
    assert re.search(r"^jumps +7\.2 nm .* 9\.7 nm ", done.stdout, re.MULTILINE)
    assert lines[-1] == "written: out.nc, figure.png"


def test_a_command_draws_without_pyplot_which_may_look_for_a_screen(here, ran, monkeypatch):
    ran(lambda: synthetic.approach(spoiled=False))
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)  # importing it raises
    assert invoke("run", "case.toml", "-o", "out.nc", "--plot", "figure.png").exit_code == 0
    assert invoke("curve", "case.toml", "--plot", "force.png").exit_code == 0
    assert {"figure.png", "force.png"} <= set(names(here))


def test_without_a_name_a_run_takes_the_place_of_an_earlier_one_of_the_same_case(here, ran):
    ran(synthetic.dwell)
    for _ in range(3):
        assert invoke("run", "case.toml").exit_code == 0
    assert names(here) == ["case.nc", "case.toml"]
    for _ in range(2):
        assert invoke("run", "case.toml", "--set", "drive.A0=5 nm").stdout.endswith("written: case-2.nc\n")
    assert invoke("run", "case.toml").stdout.endswith("written: case.nc\n")
    assert names(here) == ["case-2.nc", "case.nc", "case.toml"]
    assert "10 nm" in df.read("case.nc").attrs["case"] and "5 nm" in df.read("case-2.nc").attrs["case"]


OTHERS = {
    "a file of something else": lambda: b"of another program",
    "a sweep over the case": lambda: synthetic.dwell().assign_attrs(over="drive.A0"),
    "a force curve of the case": synthetic.force_curve,
    "a run of another version": lambda: synthetic.dwell().assign_attrs(dforce_version="0.0.1"),
}


@pytest.mark.parametrize("other", OTHERS)
def test_without_a_name_nothing_but_a_run_of_the_same_case_is_replaced(here, ran, other):
    ran(synthetic.dwell)
    there = OTHERS[other]()
    if isinstance(there, bytes):
        Path("case.nc").write_bytes(there)
    else:
        df.write(there.assign_attrs(case=df.load_case("case.toml").to_toml()), "case.nc")
    before = Path("case.nc").read_bytes()
    for _ in range(2):
        assert invoke("run", "case.toml").exit_code == 0
    assert names(here) == ["case-2.nc", "case.nc", "case.toml"] and Path("case.nc").read_bytes() == before


def test_a_run_that_was_stopped_replaces_nothing(here, ran):
    ran(lambda: synthetic.approach(directions=("approach",), spoiled=False))
    assert invoke("run", "case.toml").exit_code == 0
    before = Path("case.nc").read_bytes()
    ran(interrupted)
    assert invoke("run", "case.toml").stderr.endswith("continue with: dforce run case-2.nc\n")
    assert Path("case.nc").read_bytes() == before


def test_a_name_taken_while_the_result_is_written_is_not_replaced(here, ran, monkeypatch):
    ran(synthetic.dwell)
    write = df.write

    def late(dataset, path, **how):
        if path.name == "case.nc":
            path.write_text("of another process")
        return write(dataset, path, **how)

    monkeypatch.setattr(df, "write", late)
    assert invoke("run", "case.toml").exit_code == 0
    assert (here / "case.nc").read_text() == "of another process" and (here / "case-2.nc").exists()


def test_a_name_given_is_replaced(here, ran):
    ran(synthetic.dwell)
    (here / "out.csv").write_text("old")
    assert invoke("run", "case.toml", "-o", "out.csv", "--quiet").stdout == ""
    assert (here / "out.csv").read_text(encoding="utf-8").startswith("# Synthetic, in air")


def test_settings_change_the_case(here, ran):
    calls = ran(synthetic.dwell)
    invoke("run", "case.toml", "--set", "drive.A0=5 nm", "--set", "solver.points_per_period=512")
    assert pytest.approx(5e-9) == calls[0]["case"].problem.tones[0].A0
    assert calls[0]["case"].solver.points_per_period == 512


def test_an_example_runs_by_its_name(here, ran):
    calls = ran(synthetic.dwell)
    assert invoke("run", "figure-3-air").exit_code == 0
    assert calls[0]["case"] == df.example("figure-3-air") and (here / "figure-3-air.nc").exists()


def test_a_result_is_run_again_beside_the_old_one(here, ran):
    calls = ran(synthetic.dwell)
    invoke("run", "case.toml", "-o", "out.nc")
    for _ in range(2):
        assert invoke("run", "out.nc").exit_code == 0
    assert calls[1]["case"] == calls[0]["case"] and calls[1]["resume"] is None
    assert names(here) == ["case.toml", "out-2.nc", "out.nc"]


def test_ctrl_c_keeps_the_points_and_says_how_to_continue(here, ran):
    ran(interrupted)
    done = invoke("run", "case.toml", "-o", "out.nc")
    assert done.exit_code == 130
    assert done.stderr == (
        "dforce: stopped; 40 of 111 points are finished and kept; continue with: dforce run out.nc\n"
    )
    assert df.read(here / "out.nc").attrs["interrupted"] == 1


def test_an_interrupted_result_is_continued_in_place(here, ran):
    ran(interrupted)
    invoke("run", "case.toml", "-o", "out.nc")
    calls = ran(lambda: synthetic.approach(spoiled=False))
    assert invoke("run", "out.nc").exit_code == 0
    assert calls[-1]["resume"].attrs["interrupted"] == 1
    assert names(here) == ["case.toml", "out.nc"]
    assert not df.read(here / "out.nc").attrs["interrupted"]


@pytest.mark.parametrize(("stopped", "how"), [(0, "df.sweep repeats"), (1, "df.sweep(..., resume=...) continues")])
def test_a_sweep_is_not_replaced_by_one_curve_of_its_case(here, ran, stopped, how):
    ran(interrupted)
    invoke("run", "case.toml", "-o", "out.nc")
    df.write(df.read("out.nc").assign_attrs(over="drive.A0 cantilever.Q", interrupted=stopped), "sweep.nc")
    before = (here / "sweep.nc").read_bytes()
    done = invoke("run", "sweep.nc")
    assert done.exit_code == 2 and f"a sweep over drive.A0, cantilever.Q, which {how}" in done.stderr
    assert names(here) == ["case.toml", "out.nc", "sweep.nc"] and (here / "sweep.nc").read_bytes() == before


def test_an_interrupted_result_with_other_settings_is_a_new_run(here, ran):
    ran(interrupted)
    invoke("run", "case.toml", "-o", "out.nc")
    calls = ran(synthetic.dwell)
    invoke("run", "out.nc", "--set", "drive.A0=5 nm")
    assert calls[-1]["resume"] is None and names(here) == ["case.toml", "out-2.nc", "out.nc"]


def test_ctrl_c_before_the_first_point_writes_nothing(here, ran):
    ran(lambda: interrupted(done=0))
    done = invoke("run", "case.toml", "-o", "out.nc")
    assert done.exit_code == 130 and "nothing was written" in done.stderr and names(here) == ["case.toml"]


def test_an_interrupted_table_says_that_it_cannot_be_continued(here, ran):
    ran(interrupted)
    assert "only a .nc file can be continued" in invoke("run", "case.toml", "-o", "out.csv").stderr


def test_points_that_failed_are_told_and_make_the_exit_code_1(here, ran):
    ran(synthetic.approach)
    done = invoke("run", "case.toml")
    assert done.exit_code == 1
    assert f"2 of 222 points: {df.Status.NOT_SETTLED.sentence}" in done.stderr
    assert f"1 of 222 points: {df.Status.FAILED.sentence}" in done.stderr


SOFT = df.Advice("soft", 2e-9, 1e-9, "The sample is soft. Use a harder one.", "this test", ("sample",), "m")
STILL = df.Advice("not_settled", 2, 0, "Two points moved. Wait for them.", "this test", ("solver",))


def test_what_advice_found_is_told_after_a_run(here, ran):
    ran(lambda: synthetic.dwell().assign_attrs(attributes([SOFT])))
    done = invoke("run", "case.toml")
    assert done.stderr == "advice: The sample is soft.\nadvice with remedies: dforce check case.nc\n"
    assert invoke("run", "case.toml", "-o", "out.csv").stderr.endswith("dforce check case.toml\n")
    assert json.loads(invoke("run", "case.toml", "--json").stdout)["advice"] == [
        {
            "name": "soft",
            "found": 2e-9,
            "limit": 1e-9,
            "text": SOFT.text,
            "source": "this test",
            "about": ["sample"],
            "unit": "m",
        }
    ]


def test_points_that_did_not_settle_are_told_once(here, ran):
    ran(lambda: synthetic.approach().assign_attrs(attributes([STILL])))
    told = invoke("run", "case.toml").stderr
    assert "advice: Two points moved." in told and df.Status.NOT_SETTLED.sentence not in told
    assert df.Status.FAILED.sentence in told


def test_check_says_what_was_found_and_what_to_do(here):
    done = invoke("check", "figure-3-water")
    assert done.exit_code == 0 and done.stderr == ""
    lines = done.stdout.splitlines()
    assert "low_Q" in lines and "  found 2, limit 10 (cantilever.Q)" in lines
    assert not any(line.endswith(" ") for line in lines)
    assert invoke("check", "table-1-am").stdout == "nothing to say\n"
    assert "cantilever.k" in invoke("check", "table-1-am", "--set", "cantilever.k=40 kN/m").stdout
    assert invoke("check", "no-such-case").exit_code == 2
    answer = json.loads(invoke("check", "figure-3-water", "--json").stdout)
    assert [piece["name"] for piece in answer["advice"]] == ["indentation_and_radius", "low_Q"]
    assert answer["title"] == df.example("figure-3-water").title


def test_check_of_a_result_looks_at_its_motion(here):
    df.write(df.run(df.example("figure-3-air")), "air.nc")
    assert "thermal_motion_and_force" in invoke("check", "air.nc").stdout
    assert "thermal_motion_and_force" not in invoke("check", "figure-3-air").stdout


def test_json_is_for_machines(here, ran):
    ran(synthetic.approach)
    done = invoke("run", "case.toml", "--json")
    answer = json.loads(done.stdout)
    assert answer["file"] == "case.nc" and answer["kind"] == "approach" and answer["exit_code"] == 1
    assert answer["points"] == {"ok": 219, "not_settled": 2, "failed": 1}
    found = {(item["name"], item["direction"]): item for item in answer["found"]}
    np.testing.assert_allclose(found["jumps", "approach"]["value"], [7.2e-9])
    assert done.stdout.isascii()


@pytest.mark.parametrize(("width", "points"), [("85 mm", 240.94), ("3.5 in", 252.0)])
def test_a_picture_has_the_width_asked_for(here, ran, width, points):
    ran(lambda: synthetic.approach(spoiled=False))
    done = invoke("run", "case.toml", "--plot", "figure.svg", "--width", width)
    assert done.exit_code == 0
    found = re.search(r'<svg [^>]*width="([0-9.]+)pt"', (here / "figure.svg").read_text())
    assert float(found[1]) == pytest.approx(points, abs=0.1)


@every(
    [
        (["run", "missing.toml"], "there is no file 'missing.toml'"),
        (["run", "figure-3-ari"], "there is no file 'figure-3-ari'; did you mean the example 'figure-3-air'?"),
        (["run", "."], "is a folder"),
        (["run", "case.toml", "-o", "out.xlsx"], "ends in '.xlsx'"),
        (["run", "case.toml", "-o", "no/out.nc"], "there is no folder"),
        (["run", "case.toml", "--plot", "figure.bmp"], "ends in '.bmp'"),
        (["run", "case.toml", "--plot", "figure.svg", "--width", "2 m"], "the width 2 m is not between 30 mm and 1 m"),
        (["run", "case.toml", "--plot", "figure.svg", "--width", "wide"], "the width is 'wide'"),
        (["run", "case.toml", "--width", "85 mm"], "also write --plot"),
        (["run", "case.toml", "--set", "drive.A0"], "write path=value"),
        (["run", "case.toml", "--set", "drive.A0=5 nmm"], "'nmm' is not a known unit"),
        (["run", "case.toml", "--set", "drive.A=5 nm"], "did you mean 'drive.A0'?"),
        (["models", "dmmt"], "there is no force model 'dmmt'; did you mean 'dmt'?"),
        (["examples", "figure-3-ari"], "did you mean 'figure-3-air'?"),
        (["examples", "--write", "x.toml"], "--write needs the name of an example"),
        (["examples", "figure-3-air", "--write", "case.toml"], "exists already"),
        (["curve", "figure-3-air", "--from", "2 kHz"], "--from is '2 kHz', which is a frequency, not a length"),
        (["curve", "figure-3-air", "--from", "5"], "--from = 5 m is above 1 mm; did you mean '5 nm'?"),
        (["curve", "figure-3-air", "--from", "1 nm", "--to", "1 nm"], "starts and ends at 1 nm; write two distances"),
        (["schema", "-o", "schema.xml"], "ends in '.xml'"),
    ]
)
def test_a_mistake_is_one_sentence_and_nothing_is_written(words, sentence, here, ran):
    ran(synthetic.dwell)
    done = invoke(*words)
    assert done.exit_code == 2 and sentence in done.stderr
    assert done.stderr.startswith("dforce: ") and done.stderr.count("\n") == 1 and done.stdout == ""
    assert names(here) == ["case.toml"]


def test_a_traceback_is_shown_only_when_asked_for(here):
    assert "Traceback" not in invoke("run", "missing.toml").stderr
    assert "Traceback" in invoke("run", "missing.toml", "--traceback").stderr


def test_an_error_inside_is_told_as_such(here, run_as):
    def broken(*_, **__):
        raise ZeroDivisionError("division by zero")

    run_as(broken)
    done = invoke("run", "case.toml")
    assert done.exit_code == 3 and "please report it: ZeroDivisionError: division by zero" in done.stderr
    assert names(here) == ["case.toml"]


def test_models_are_listed_with_their_parameters():
    done = invoke("models")
    assert done.exit_code == 0
    assert all(name in done.stdout for name in df.forces.REGISTRY)
    listed = {model["name"]: model for model in json.loads(invoke("models", "--json").stdout)}
    assert set(listed) == set(df.forces.REGISTRY)
    (viscosity,) = (p for p in listed["kelvin_voigt"]["parameters"] if p["name"] == "viscosity")
    assert viscosity["unit"] == "Pa s" and viscosity["low"] == "0 Pa s"


@pytest.mark.parametrize(
    ("word", "found"),
    [
        ("charge", {"dlvo"}),
        ("prony", {"generalized_maxwell"}),
        ("Zener", {"sls", "sls_simple"}),
        ("EDL", {"dlvo"}),
        ("adhesion", {"adhesion_hysteresis", "dmt", "jkr", "maugis_dugdale"}),
        ("viscoelastic", {"generalized_maxwell", "kelvin_voigt", "power_law", "sls", "sls_simple"}),
        ("Derjaguin", {"dlvo", "dmt"}),
        ("memory", {"generalized_maxwell", "power_law", "sls", "sls_simple"}),
    ],
)
def test_a_word_lists_the_models_that_mention_it(word, found):
    listed = {model["name"] for model in json.loads(invoke("models", word, "--json").stdout)}
    assert listed == found
    assert all(f"  {name} " in invoke("models", word).stdout for name in found)


@every(df.forces.REGISTRY)
def test_every_model_has_a_page(name):
    done = invoke("models", name)
    assert done.exit_code == 0 and done.stdout.startswith(name) and "source:" in done.stdout
    keys = df.forces.REGISTRY[name].keys()
    assert all(key in done.stdout for key in keys)


def test_examples_are_listed_shown_and_written(here):
    assert all(name in invoke("examples").stdout for name in df.examples())
    text = df.examples()["figure-3-air"].text
    assert invoke("examples", "figure-3-air").stdout == text
    assert invoke("examples", "figure-3-air", "--write", "mine.toml").exit_code == 0
    assert (here / "mine.toml").read_text(encoding="utf-8") == text
    assert df.load_case("mine.toml") == df.example("figure-3-air")


def test_a_force_curve_is_written_and_drawn_between_the_distances_given(here, monkeypatch):
    asked = []

    def force_curve(case, distance=None, speed=None):
        asked.append((distance, speed))
        return synthetic.force_curve()

    monkeypatch.setattr(df, "force_curve", force_curve, raising=False)
    done = invoke(
        "curve", "figure-3-air", "--from", "3 nm", "--to", "-0.5 nm", "--points", "8",
        "--speed", "2 um/s", "-o", "curve.csv", "--plot", "curve.svg",
    )  # fmt: skip
    assert done.exit_code == 0 and "lowest force" in done.stdout and "written: curve.csv, curve.svg" in done.stdout
    np.testing.assert_allclose(asked[0][0], np.linspace(3e-9, -0.5e-9, 8))
    assert asked[0][1] == 2e-6
    assert names(here) == ["case.toml", "curve.csv", "curve.svg"]
    assert invoke("curve", "figure-3-air", "--to", "0 nm").exit_code == 0
    assert asked[1][0] is None  # asks where the force is felt
    assert asked[2][0][0] == 2e-9 and asked[2][0][-1] == 0.0 and len(asked[2][0]) == 501


def test_the_schema_accepts_the_examples(here):
    assert invoke("schema", "-o", "schema.json").exit_code == 0
    printed = json.loads(invoke("schema").stdout)
    assert json.loads((here / "schema.json").read_text(encoding="utf-8")) == printed
    jsonschema.Draft202012Validator.check_schema(printed)


def test_the_version_is_told():
    assert invoke("--version").stdout.strip() == f"dForce {df.__version__}"


def test_help_names_every_command():
    text = invoke("--help").stdout
    assert all(command in text for command in ("run", "check", "models", "examples", "curve", "schema"))


@pytest.mark.parametrize(
    ("text", "spelled"), [("54°", "54 deg"), ("µm", "um"), ("δ ≤ 3", "delta <= 3"), ("– é 中", "- e ?"), ("d²", "d^2")]
)
def test_what_a_terminal_lacks_is_spelled_out(text, spelled):
    assert "".join(c if c.isascii() else plain(UnicodeEncodeError("ascii", c, 0, 1, ""))[0] for c in text) == spelled


def program(*words, env=None):
    """Run the program as a user does."""
    code = "import sys; from dforce.cli import main; sys.argv[0] = 'dforce'; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, check=False, env=os.environ | (env or {})
    )


def test_exit_codes_reach_the_shell():
    assert program("--version").returncode == 0
    failed = program("run", "missing.toml")
    assert failed.returncode == 2 and failed.stderr.startswith(b"dforce: there is no file") and failed.stdout == b""
    assert program("--no-such-option").returncode == 2


def test_a_backend_that_matplotlib_lacks_is_the_mistake_of_the_environment(workdir):
    Path("result.nc").touch()
    done = program("plot", "result.nc", env={"MPLBACKEND": "nonsense"})
    assert done.returncode == 2
    assert done.stderr.startswith(
        b"dforce: matplotlib has no backend 'nonsense', which the environment variable MPLBACKEND"
    )


STOPPABLE = """
import signal, sys, time
import dforce as df, synthetic
from dforce.cli import main

signal.signal(signal.SIGINT, signal.default_int_handler)  # as in a terminal, also where the tests run in the background

def run(case, progress=None, resume=None):
    dataset = synthetic.approach(directions=("approach",), spoiled=False)
    dataset["status"][7:] = df.Status.NOT_COMPUTED
    try:
        print("started", flush=True)
        for _ in range(600):
            time.sleep(0.1)  # a signal that comes right before a sleep does not end it
    except KeyboardInterrupt:
        return dataset.assign_attrs(interrupted=1)

df.run = run
sys.argv = ["dforce", "run", "case.toml", "--quiet"]
main()
"""


STOPPED_LATE = """
import os, signal, sys
import dforce as df, synthetic
from dforce.cli import main
from dforce.core.stopping import at_end

signal.signal(signal.SIGINT, signal.default_int_handler)
write = df.write

def run(case, progress=None, resume=None):
    at_end(True)
    return synthetic.approach(spoiled=False)

def late(*args, **kwargs):
    os.kill(os.getpid(), {number})
    return write(*args, **kwargs)

df.run, df.write = run, late
sys.argv = ["dforce", "run", "case.toml", "--quiet"]
main()
"""


@pytest.mark.skipif(os.name != "posix", reason="signals as a terminal or a batch queue sends them")
@pytest.mark.parametrize(
    "sent",
    [(signal.SIGINT,), pytest.param((signal.SIGTERM,), marks=pytest.mark.long), (signal.SIGTERM, signal.SIGTERM)],
)
def test_a_real_ctrl_c_or_sigterm_keeps_the_points_and_ends_with_130(here, sent):
    path = os.pathsep.join([str(Path(synthetic.__file__).parent), *sys.path])
    child = subprocess.Popen(
        [sys.executable, "-c", STOPPABLE], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": path},
    )  # fmt: skip
    assert child.stdout is not None and child.stdout.readline() == b"started\n"
    for number in sent:
        child.send_signal(number)
    _, said = child.communicate(timeout=60)
    assert child.returncode == 130
    assert said == b"dforce: stopped; 7 of 111 points are finished and kept; continue with: dforce run case.nc\n"
    assert count_status(df.read("case.nc"))[df.Status.OK] == 7


@pytest.mark.skipif(os.name != "posix", reason="signals as a terminal or a batch queue sends them")
@pytest.mark.parametrize("sent", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_a_stop_while_the_result_is_written_loses_nothing(here, sent):
    path = os.pathsep.join([str(Path(synthetic.__file__).parent), *sys.path])
    script = STOPPED_LATE.format(number=int(sent))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, env=os.environ | {"PYTHONPATH": path})
    assert done.returncode == 130
    assert done.stderr == b"dforce: stopped; the result is complete and kept\n"
    assert not df.read("case.nc").attrs["interrupted"]


@pytest.mark.parametrize("encoding", some_long(["ascii", "cp437", "cp1252"], long=["cp437", "cp1252"]))
def test_a_console_without_utf_8_shows_everything(encoding):
    for words in (("models", "kelvin_voigt"), ("models",), ("examples",), ("--help",)):
        done = program(*words, env={"PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"})
        assert done.returncode == 0, done.stderr
        done.stdout.decode(encoding)


def test_the_shell_completes_examples_and_models():
    done = program(env={"_DFORCE_COMPLETE": "complete_bash", "COMP_WORDS": "dforce models kelv", "COMP_CWORD": "2"})
    assert done.stdout.split() == [b"kelvin_voigt"]
    done = program(env={"_DFORCE_COMPLETE": "complete_bash", "COMP_WORDS": "dforce run figure-3", "COMP_CWORD": "2"})
    wanted = [name.encode() for name in df.examples() if name.startswith("figure-3")]
    assert len(wanted) > 1
    assert done.stdout.split() == wanted


def test_help_loads_nothing_heavy():
    heavy = ("numba", "pint", "scipy", "xarray", "matplotlib", "pandas", "numpy", "pydantic_core")
    code = (
        "import sys; from dforce.cli.app import app\n"
        "try: app(['--help'])\n"
        f"except SystemExit: print(sorted(set(sys.modules) & set({heavy!r})))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_a_run_without_a_picture_loads_no_matplotlib(tmp_path):
    code = (
        "import sys; from dforce.cli.app import app\n"
        f"try: app(['run', 'figure-3-air', '--set', 'experiment.zc.points=3', '-o', {str(tmp_path / 'a.nc')!r}])\n"
        "except SystemExit as end: print(end.code, 'matplotlib' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "0 False"


LOADING = """
import os, signal, sys, types

class Stop:
    def find_spec(self, name, path=None, target=None):
        if name == "typer":
            os.kill(os.getpid(), {number})

signal.signal(signal.SIGINT, signal.default_int_handler)
sys.meta_path.insert(0, Stop())
from dforce.cli import main
main()
"""


@pytest.mark.skipif(os.name != "posix", reason="signals as a terminal or a batch queue sends them")
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_while_the_program_loads_ends_it_in_one_sentence(sent):
    done = subprocess.run([sys.executable, "-c", LOADING.format(number=int(sent))], capture_output=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, b"", b"dforce: stopped\n")


def test_measured_data_are_copied_with_the_cases_that_fit_them(workdir):
    done = CliRunner().invoke(app, ["examples", "--data"])
    assert done.exit_code == 0, done.output
    for name in ("air", "liquid", "stiff"):
        case = df.load_case(f"{name}.toml")
        assert case.data.file == f"{name}.csv"
        assert Path(case.data.file).exists()
        assert case.fit.free
    assert CliRunner().invoke(app, ["thermal", "thermal.csv", "--json"]).exit_code == 0
    assert CliRunner().invoke(app, ["examples", "--data"]).exit_code == 0  # the same files again
    Path("air.csv").write_text("mine", encoding="utf-8")
    refused = CliRunner().invoke(app, ["examples", "--data"])
    assert refused.exit_code == 2
    assert "'air.csv' is there already, with other content" in refused.stderr
    assert Path("air.csv").read_text(encoding="utf-8") == "mine"
    assert CliRunner().invoke(app, ["examples", "stiff", "--data"]).exit_code == 2
