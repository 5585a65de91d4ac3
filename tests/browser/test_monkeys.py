"""Random clicks, typing and uploads: the server's log and the browser's console stay empty, and the window still works."""

from __future__ import annotations

import contextlib
import random
import time

import pytest
from served import served

import dforce as df

SECONDS, LEAST = 30.0, 20  # and things done in them; on a busy machine they take longer
SOON = 800  # ms; what moves away or is covered meanwhile is left
THINGS = "button, [role=tab], [role=menuitem], [role=option], [role=switch], select, input:not([type=file]), textarea, summary"
TEXTS = (
    "", "5", "-1", "1e400", "0", "7,5", "20 nm", "1 GPa", "NaN", "d^2", "../../etc/passwd", "<b>x</b>", "{{ 7*7 }}", "日本",
    "a" * 3000, "-P1*exp(-d/P2)",
)  # fmt: skip
KEYS = ("Escape", "Enter", "Tab", "ArrowDown", "ArrowUp", "ArrowLeft", "PageUp", "Home", "Delete", "Control+z")
FILES = {
    "curve.csv": "zc (nm),amplitude (nm)\n10,9\n9,8.5\n8,8\n7,7\n6,6\n",
    "empty.csv": "",
    "noise.bin": "\x00\x01\x02" * 300,
    "case.toml": df.example("figure-3-air").to_toml(),
    "bad.toml": "[cantilever]\nf0 = \n",
    "project.dforce": "no project",
}


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with served(tmp_path_factory.mktemp("monkeys")) as started:
        yield started


class Monkey:
    """Does something at random, the same for the same seed as far as the page is."""

    def __init__(self, page, seed, folder):
        self.page, self.random, self.done = page, random.Random(seed), []
        self.files = []
        for name, text in FILES.items():
            file = folder / name
            file.write_text(text, encoding="utf-8")
            self.files.append(file)

    def click(self):
        things = [one for one in self.page.query_selector_all(THINGS) if one.is_visible()]
        if things:
            thing = self.random.choice(things)
            self.done.append(f"click {thing.evaluate('(one) => one.outerHTML.slice(0, 80)')}")
            thing.click(timeout=SOON)

    def type(self):
        text = self.random.choice(TEXTS)
        boxes = [one for one in self.page.query_selector_all("input[type=text], textarea") if one.is_visible()]
        if boxes:
            box = self.random.choice(boxes)
            self.done.append(f"type {text[:40]!r} into {box.evaluate('(one) => one.outerHTML.slice(0, 80)')}")
            box.fill(text, timeout=SOON)

    def press(self):
        key = self.random.choice(KEYS)
        self.done.append(f"press {key}")
        self.page.keyboard.press(key)

    def slide(self):
        sliders = [one for one in self.page.query_selector_all("input[type=range]") if one.is_visible()]
        if sliders:
            share = self.random.random()
            self.done.append(f"slide to {share:.2f}")
            self.random.choice(sliders).evaluate(
                """(one, share) => {
                    one.value = +one.min + (one.max - one.min) * share;
                    one.dispatchEvent(new Event("input"));
                }""",
                share,
            )

    def upload(self):
        inputs = self.page.query_selector_all("input[type=file]")
        if inputs:
            file = self.random.choice(self.files)
            self.done.append(f"upload {file.name}")
            self.random.choice(inputs).set_input_files(file, timeout=SOON)

    def reload(self):
        self.done.append("reload")
        self.page.reload()
        self.page.locator(".df-main").first.wait_for()

    def act(self):
        """Do one thing; what a page no longer has when it comes to it is no fault."""
        from playwright.sync_api import Error

        what = (self.click, self.type, self.press, self.slide, self.upload, self.reload)
        with contextlib.suppress(Error):
            self.random.choices(what, (40, 20, 15, 15, 8, 1))[0]()


@pytest.mark.long
@pytest.mark.timeout(900)
@pytest.mark.parametrize("seed", range(5))
def test_whatever_one_presses_nothing_breaks(visit, server, tmp_path, seed):
    window = visit()
    quiet = len(server.said)
    monkey = Monkey(window.page, seed, tmp_path)
    until = time.monotonic() + SECONDS
    while time.monotonic() < until or len(monkey.done) < LEAST:
        monkey.act()
    assert server.said[quiet:] == [], "\n".join(monkey.done)
    window.page.reload()
    window.open_example()
    with window.redrawn():  # of whatever quantities were chosen
        window.type("drive.A0", "7")
    assert server.said[quiet:] == [], "\n".join(monkey.done)
