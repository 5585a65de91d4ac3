"""The worked examples of CONTRIBUTING work as what is shipped: an experiment, an observable, a picture, a kind of result."""

import dataclasses
import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import dforce as df
from dforce.results import kinds
from dforce.results.curves import pictures_of

TEXT = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")


def load(name: str, written: str, file: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a module of the package that stands elsewhere."""
    file.write_text(written, encoding="utf-8")
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def settling(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Add the experiment that CONTRIBUTING shows."""
    [written] = [block for block in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL) if "(CurveExperiment)" in block]
    module = load("dforce.experiments.settling", written, tmp_path / "settling.py", monkeypatch)
    monkeypatch.setitem(df.experiments.EXPERIMENTS, "settling", module.Settling)


def test_the_experiment_of_contributing_runs_from_a_case_and_agrees_with_an_approach(settling: None) -> None:
    grid = {"start": "12 nm", "stop": "8 nm", "points": 2}
    case = df.example("figure-3-air").replace(experiment={"kind": "settling", "zc": grid})
    result = df.run(case)
    known = df.run(case.replace(experiment={"kind": "approach", "zc": grid}))
    assert (result["settling_periods"] > 100).all()  # Q is 255
    np.testing.assert_allclose(result["amplitude"][0], known["amplitude"][0], rtol=1e-5)  # free: one state
    assert df.report(result).findings
    grid = df.sweep(case, over={"sample.youngs_modulus": ["0.5 GPa", "1 GPa"], "drive.A0": ["9 nm", "10 nm"]})
    alone = df.run(case.replace("sample.youngs_modulus", "0.5 GPa").replace("drive.A0", "9 nm"))
    np.testing.assert_array_equal(grid["settling_periods"][0, 0], alone["settling_periods"])
    np.testing.assert_array_equal(grid["amplitude"][0, 0], alone["amplitude"])


USED = """
import dforce as df
from dforce.core.quantities import OBSERVABLES
from dforce.observables.deviation import DEVIATIONS

found = df.run(df.example("table-1-am"))
assert found.asymmetry.attrs["units"] == OBSERVABLES["asymmetry"].unit == "m"
assert float(found.asymmetry) == found.max_deflection + found.min_deflection - 2.0 * found.mean_deflection != 0.0
assert "asymmetry" in DEVIATIONS
"""


def test_the_observable_of_contributing_is_in_results_and_counts_in_the_estimate(tmp_path: Path) -> None:
    row, formula = (block for block in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL) if '"asymmetry"' in block)
    package = tmp_path / "dforce"
    shutil.copytree(Path(df.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    for name, before, line in (
        ("core/quantities.py", '    Observable("peak_force"', row.rstrip() + ",\n"),
        ("observables/finish.py", '        "peak_force": ', formula),
    ):
        text = (package / name).read_text(encoding="utf-8")
        assert text.count(before) == 1
        (package / name).write_text(text.replace(before, line + before), encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    subprocess.run([sys.executable, "-c", USED], check=True, env=environment, timeout=120)


def test_the_picture_of_contributing_is_offered_and_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    [row] = [block for block in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL) if block.startswith("Picture(")]
    result = df.approach(df.example("table-1-am"), zc=["12 nm", "10 nm", "8 nm"])
    kind = kinds.known_kind(result)
    longer = dataclasses.replace(kind, pictures=(*kind.pictures, eval(row, vars(kinds))))
    monkeypatch.setattr(kinds, "KINDS", (longer, *kinds.KINDS))
    [picture] = [one for one in pictures_of(result) if one.title == "power"]
    assert len(df.plot.draw(result, picture, df.plot.Sheet())) == 2


def test_the_kind_of_contributing_is_summed_up_and_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    [row] = [block for block in blocks if block.startswith("Kind(")]
    for module, first in (("findings", "summary"), ("plot", "picture")):
        [written] = [block for block in blocks if block.startswith(f'"""The {first} of switching rates')]
        load(f"dforce.{module}.switching", written, tmp_path / f"{module}.py", monkeypatch)
    added = eval(row, vars(kinds))
    result = xr.Dataset({"switching_rate": ("temperature", [10.0, 200.0])}, {"temperature": [300.0, 350.0], "zc": 8e-9})
    assert kinds.known_kind(result).name == "dwell"  # as what has one distance is, unless a row stands before
    monkeypatch.setattr(kinds, "KINDS", (added, *kinds.KINDS))
    assert [one.text for one in df.summary(result)] == ["10 1/s", "200 1/s"]
    [axes] = df.plot.overview(result, df.plot.Sheet())
    assert axes.get_lines()[0].get_ydata().tolist() == [10.0, 200.0]


def test_who_draws_and_sums_up_tells_no_kinds_apart() -> None:
    """The marks of kinds of results stand in their rows alone."""
    package = Path(df.__file__).parent
    marks = re.findall(r"_marked\(\"(\w+)\"\)", (package / "results/kinds.py").read_text(encoding="utf-8"))
    assert len(marks) >= 7
    for name in (
        "plot/overview.py",
        "plot/pictures.py",
        "results/curves.py",
        "gui/curves/plots.py",
        "findings/summary.py",
    ):
        text = (package / name).read_text(encoding="utf-8")
        assert [mark for mark in marks if re.search(rf'"{mark}" (not )?in ', text)] == [], name
