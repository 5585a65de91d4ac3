"""The Python script of a case."""

from __future__ import annotations

import subprocess
import sys

import pytest
import xarray as xr
from every import every

import dforce as df

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`


@pytest.mark.parametrize("name", list(df.examples()))
def test_the_script_of_every_example_builds_the_same_case(name):
    before, _, _ = df.example(name).to_python().partition("result =")
    names: dict[str, object] = {}
    exec(before, names)
    assert names["case"].to_toml() == df.example(name).to_toml()


@every(sorted(df.forces.REGISTRY))
def test_the_script_holds_every_force(model):
    force = df.forces.REGISTRY[model]
    table = {"model": model, **force.example}
    more = ("sample.thickness=50 nm", "sample.radius=20 nm", "tip.half_angle=20 deg", "medium.name=water")
    case = df.example("figure-3-air").set(*more).replace(forces=[table])
    before, _, _ = case.to_python().partition("result =")
    names: dict[str, object] = {}
    exec(before, names)
    assert names["case"] == case


def test_the_script_of_a_case_gives_the_same_numbers_and_no_text_in_it_is_code(tmp_path):
    title = '"); raise SystemExit("\\\n#'
    case = df.example("figure-3-air").set("experiment.zc.points=5").replace(title=title)
    script = tmp_path / "script.py"
    script.write_text(case.to_python("out"), encoding="utf-8")
    subprocess.run([sys.executable, script], cwd=tmp_path, check=True, capture_output=True)
    again = df.read(tmp_path / "out.nc")
    xr.testing.assert_equal(again, df.run(case))
    assert again.attrs["title"] == title
    assert (tmp_path / "out.png").exists()
