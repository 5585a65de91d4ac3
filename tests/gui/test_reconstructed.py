"""A reconstructed force in the window: drawn with its errors and gaps, kept and saved."""

from __future__ import annotations

import asyncio
import base64

import numpy as np
import pytest
from simulated import until, window

import dforce as df
from dforce.gui.curves.figures import Layer
from dforce.gui.files import file_menu
from dforce.gui.measured.reconstruction import figure_of
from dforce.results.dataset import reader_unit


def numbers(packed):
    return np.frombuffer(base64.b64decode(packed["bdata"]), packed["dtype"])


@pytest.fixture(scope="module")
def force():
    """The force of an approach with a jump, which leaves a gap."""
    case = df.example("figure-3-air").replace("drive.A0", "20 nm")
    case = case.replace(experiment=None)
    return df.reconstruct(df.approach(case, zc=np.linspace(28e-9, 4e-9, 101), direction="approach"))


def test_a_reconstructed_force_is_drawn_with_its_errors_and_its_gaps(force):
    figure = figure_of(force).figure
    by_name, scale = {trace["meta"]: trace for trace in figure["data"]}, reader_unit(force["force"])[0]
    assert set(by_name) == {"force", "force_error", "law_force"}
    assert numbers(by_name["force"]["y"]) == pytest.approx(force["force"].values / scale, nan_ok=True)
    assert numbers(by_name["force"]["x"]) == pytest.approx(1e9 * force["distance"].values)
    gaps = [(shape["x0"], shape["x1"]) for shape in figure["layout"]["shapes"]]
    assert len(gaps) > 0
    assert np.array(gaps) == pytest.approx(1e9 * np.stack([force["gap_low"].values, force["gap_high"].values], axis=1))
    bands = [trace for trace in figure["data"] if trace["meta"] == "force_error"]
    x, y = (np.concatenate([numbers(band[key]) for band in bands]) for key in "xy")
    known = np.flatnonzero(np.isfinite(force["force"].values))
    assert len(x) == 2 * len(known)
    for place in known[::20]:
        edges = np.sort(y[np.abs(x - 1e9 * force["distance"].values[place]) < 1e-9])
        value, error = float(force["force"][place]) / scale, float(force["force_error"][place]) / scale
        assert edges == pytest.approx([value - 2.0 * error, value + 2.0 * error])


def test_a_file_of_a_reconstructed_force_is_opened_and_its_figure_saved(tmp_path, force):
    data = file_menu.written(lambda path: df.write(force, path), ".nc")

    async def flow():
        async with window(tmp_path) as (_, page):
            await page.files.open(data, "force.nc")
            await until(
                lambda: any(trace.get("meta") == "law_force" for trace in page.plots.drawn.figure.get("data", []))
            )
            assert page.plots.shown is None and not page.view.said.wrong
            assert len(page.view.document.results) == 1
            assert page.view.document.case().forces == df.Case.from_toml(force.attrs["case"]).forces

    asyncio.run(flow())
    assert file_menu.figure_file([Layer(force)], None, ".png", "85 mm").startswith(b"\x89PNG")
