"""The worked examples of CONTRIBUTING are an experiment and an observable like those that are shipped."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import dforce as df

TEXT = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")


@pytest.fixture
def settling(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Add the experiment that CONTRIBUTING shows."""
    [written] = [block for block in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL) if "(CurveExperiment)" in block]
    file = tmp_path / "settling.py"
    file.write_text(written, encoding="utf-8")
    spec = importlib.util.spec_from_file_location("dforce.experiments.settling", file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
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
