"""Cases and results of older versions open, run, and tell what has changed."""

import dataclasses

import pytest

import dforce as df
from dforce.core.log import listening

CASE = df.Case(
    cantilever={"f0": "50 kHz", "k": "1 N/m", "Q": 10}, drive={"A0": "10 nm"}, tip={"radius": "10 nm"},
    sample={"youngs_modulus": "1 GPa"}, forces=[df.forces.Hertz()], experiment={"kind": "dwell", "zc": "8 nm"},
)  # fmt: skip
OLD, NOW = 'integrator = "adaptive"', 'method = "transient"\nintegrator = "engine"'
SENTENCE = 'solver.integrator = "adaptive" no longer exists and runs as "engine"; write "engine" in its place.'


def test_a_case_that_names_the_adaptive_integrator_runs_on_the_engine(tmp_path):
    file, heard = tmp_path / "old.toml", []
    file.write_text(f"{CASE.to_toml()}\n[solver]\n{OLD}\n", encoding="utf-8")
    with listening(heard.append):
        case = df.load_case(file)
    assert heard == [SENTENCE]
    assert (case.solver.method, case.solver.integrator) == ("transient", "engine")


def test_a_result_that_names_the_adaptive_integrator_opens_with_its_case(tmp_path):
    result, heard = df.run(CASE.replace("solver", {"method": "transient", "integrator": "engine"})), []
    assert NOW in result.attrs["case"]
    df.write(result.assign_attrs(case=result.attrs["case"].replace(NOW, OLD)), tmp_path / "old.nc")
    kept = df.read(tmp_path / "old.nc")
    with listening(heard.append):
        case = df.load_case(tmp_path / "old.nc")
    assert heard == [SENTENCE]
    assert df.run(case)["amplitude"].values == pytest.approx(kept["amplitude"].values, rel=1e-12)


def test_a_link_that_names_the_adaptive_integrator_shows_the_engine():
    pytest.importorskip("nicegui")
    from dforce.gui.document.document import Document
    from dforce.gui.window.address import from_link, to_link

    now = Document.of(CASE)
    table = now.table | {"solver": {"integrator": "adaptive"}}
    found = from_link(to_link(dataclasses.replace(now, table=table, opened=table)), now)
    assert found.table["solver"] == {"method": "transient", "integrator": "engine"}
    assert not found.edited
