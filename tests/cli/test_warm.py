"""`dforce warm`: compiles ahead what cases need."""

import re

import synthetic
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app
from dforce.kernel import cache


def test_each_case_is_run_once_and_the_folder_is_told(workdir, run_as):
    ran = []
    run_as(lambda case, **_: ran.append(case.title) or synthetic.dwell())
    (workdir / "mine.toml").write_text(synthetic.CASE, encoding="utf-8")
    environment = {"DFORCE_CACHE_DIR": str(workdir / "cache")}
    done = CliRunner().invoke(app, ["warm", "mine.toml", "figure-3-air"], env=environment)
    assert done.exit_code == 0 and done.stdout == f"{workdir / 'cache'}\n0 kernels, 0.0 MB\n"
    assert ran == [df.load_case("mine.toml").title, df.example("figure-3-air").title]
    first, second = done.stderr.splitlines()
    assert re.match(r"mine\.toml: ready after \d+ s \(1 of 2, about ", first) and second.endswith("(2 of 2)")


def test_nothing_is_ready_where_no_code_can_be_kept(workdir, run_as):
    (workdir / "file").write_text("no folder", encoding="utf-8")
    run_as(lambda case, **_: cache.place("x = 1") and synthetic.dwell())
    environment = {"DFORCE_CACHE_DIR": str(workdir / "file")}
    done = CliRunner().invoke(app, ["warm", "figure-3-air", "hysteresis"], env=environment)
    assert done.exit_code == 2 and "ready after" not in done.output
    assert done.stderr.splitlines()[-1] == "figure-3-air: not ready, because its compiled code was not kept"


def test_all_examples_are_run_where_no_case_is_named(run_as):
    ran = []
    run_as(lambda case, **_: ran.append(case.title) or synthetic.dwell())
    assert CliRunner().invoke(app, ["warm"]).exit_code == 0
    assert ran == [example.title for example in map(df.example, df.examples())]


def test_a_name_that_is_wrong_is_told_before_anything_is_run(run_as):
    ran = []
    run_as(lambda case, **_: ran.append(case))
    done = CliRunner().invoke(app, ["warm", "figure-3-air", "figure-3-vacuum"])
    assert done.exit_code == 2 and "figure-3-vacuum" in done.stderr and not ran


def test_a_run_that_is_stopped_ends_the_command(run_as):
    ran = []
    run_as(lambda case, **_: ran.append(case) or synthetic.approach().assign_attrs(interrupted=1))
    done = CliRunner().invoke(app, ["warm", "figure-3-air", "hysteresis"])
    assert (done.exit_code, done.stderr, len(ran)) == (130, "dforce: stopped\n", 1)
