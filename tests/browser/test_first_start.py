"""The very first start: nothing is compiled yet."""

from __future__ import annotations

import pytest
from served import Window, served

import dforce as df
from dforce.gui.document.document import FIRST

COLD = 540_000  # ms; some 30 s on a machine that does nothing else


@pytest.mark.long
def test_the_first_start_says_in_the_empty_plot_what_it_waits_for_and_draws_by_itself(browser, tmp_path, monkeypatch):
    monkeypatch.setenv("DFORCE_CACHE_DIR", str(tmp_path / "cache"))
    with served(tmp_path / "window") as server:
        page = browser.new_page()
        page.set_default_timeout(COLD)
        window = Window(page, server)
        window.go()
        window.begin()
        words = page.locator(".df-waiting").get_by_text("Compiling")
        words.wait_for()
        assert page.locator(".df-waiting").get_by_role("progressbar").is_visible()
        plot, text = page.locator(".df-main").bounding_box(), words.bounding_box()
        assert abs(text["x"] + text["width"] / 2 - plot["x"] - plot["width"] / 2) < 2.0
        assert abs(text["y"] - plot["y"] - plot["height"] / 2) < 50.0  # there is a bar above it
        window.drawn()
        assert not page.locator(".df-waiting").is_visible()
        window.shows(df.example(FIRST))
        page.close()
