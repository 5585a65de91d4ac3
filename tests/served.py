"""The window as people meet it: `dforce gui` in a process of its own, and a Chromium in front of it."""

from __future__ import annotations

import contextlib
import functools
import json
import math
import os
import queue
import re
import socket
import subprocess
import threading
import time
import urllib.parse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import dforce as df
from dforce.core import child
from dforce.gui.window.server import find_browser
from dforce.results.dataset import reader_unit

FLAGS = (
    "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-default-apps", "--disable-extensions",
    "--disable-features=WebUIOmniboxPopup,WebUIOmniboxAimPopup",  # a page of their own in each window
)  # fmt: skip


READY = re.compile(r"dForce is ready at (\S+)")
STARTING = 120.0  # s for a server to start, on a busy machine
POLLING = 50  # ms; by default a page that is waited for is drawn sixty times a second
HOVERING = 250  # ms after which a chart shows the point under the pointer


class Server:
    """`dforce gui` on a free port, with a folder of its own.

    Parameters
    ----------
    folder
        Where it keeps what is typed and computed.
    arguments
        More of the command line.
    port
        Its port; None for one of its own, which no other server takes while this one is started again, 0 for the usual one.

    Raises
    ------
    RuntimeError
        When it ends before it is ready, with what it said.
    """

    def __init__(self, folder: Path, *arguments: str, port: int | None = None) -> None:
        self.folder, self.arguments = folder, arguments
        if port is None:
            with socket.create_server(("127.0.0.1", 0)) as free:
                port = free.getsockname()[1]
        self.port = port
        self.start()

    def start(self) -> None:
        """Start it, after the first time at the same port."""
        command = child.command("-m", "dforce", "gui", "--no-browser", "--folder", str(self.folder), *self.arguments)
        if self.port:
            command += ["--port", str(self.port)]
        # NiceGUI waits for a simulated browser where it finds that pytest runs
        environment = {key: value for key, value in child.environment().items() if "PYTEST" not in key}
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=environment,
        )
        self.said: list[str] = []
        lines: queue.Queue[str | None] = queue.Queue()
        self.listener = threading.Thread(target=self._listen, args=(lines,), daemon=True)
        self.listener.start()
        until = time.monotonic() + STARTING
        with contextlib.suppress(queue.Empty):
            while (line := lines.get(timeout=max(0.0, until - time.monotonic()))) is not None:
                if ready := READY.search(line):
                    self.address = ready[1]
                    self.port = int(urllib.parse.urlsplit(self.address).port or 0)
                    return
        self.kill()
        raise RuntimeError("the server did not start: " + "".join(self.said))

    def _listen(self, lines: queue.Queue[str | None]) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as stream:
            for line in stream:
                self.said.append(line)
                lines.put(line)
        lines.put(None)

    @property
    def home(self) -> str:
        """The address without its secret."""
        return f"http://127.0.0.1:{self.port}"

    @property
    def memory(self) -> float | None:
        """The memory that it takes (MB), None where the system does not tell."""
        status = Path(f"/proc/{self.process.pid}/status")
        found = re.search(r"VmRSS:\s+(\d+)", status.read_text()) if status.exists() else None
        return int(found[1]) / 1024 if found else None

    def kill(self) -> None:
        """End it at once, as a crash or a lost battery does."""
        self.process.kill()
        self.process.wait()
        self.listener.join()

    def stop(self) -> None:
        """End it as Ctrl-C does."""
        self.process.terminate()
        try:
            self.process.wait(timeout=20)
            self.listener.join()
        except subprocess.TimeoutExpired:
            self.kill()


@contextlib.contextmanager
def served(folder: Path, *arguments: str) -> Iterator[Server]:
    """Give a server, and end it."""
    server = Server(folder, *arguments)
    try:
        yield server
    finally:
        server.stop()


@contextlib.contextmanager
def chromium(*flags: str) -> Iterator[Any]:
    """Give a browser without a screen, which Playwright drives, with more flags on its command line."""
    from playwright.sync_api import sync_playwright

    sandbox = ("--no-sandbox",) if hasattr(os, "geteuid") and os.geteuid() == 0 else ()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_browser(), args=[*FLAGS, *flags, *sandbox])
        try:
            yield browser
        finally:
            browser.close()


class Window:
    """One page of the window, and what a person does with it.

    Parameters
    ----------
    page
        A page of Playwright, which is sent to the server's address.
    """

    def __init__(self, page: Any, server: Server) -> None:
        self.page, self.server = page, server

    def go(self) -> None:
        """Open the address that the server printed."""
        # a class is told the name of the computer, which need not lead to it here
        address = urllib.parse.urlsplit(self.server.address)
        self.page.goto(f"{self.server.home}/?{address.query}")

    def open(self) -> None:
        """Open the window, and wait for the first curve."""
        self.go()
        self.begin()
        self.drawn()

    def begin(self) -> None:
        """Leave the first page, where it is shown, for the first example."""
        self.page.locator(".df-start, .df-main .df-chart").locator("visible=true").first.wait_for()
        if self.page.get_by_role("button", name="Two states and jumps").is_visible():
            self.page.get_by_role("button", name="Two states and jumps").click()
            self.page.get_by_role("button", name="Start", exact=True).click()
        self.page.locator(".df-main .df-chart").first.wait_for()

    def revision(self, chart: str = ".df-main") -> int:
        """Return how often the server has had a chart drawn."""
        return int(self.page.locator(f"{chart} .df-chart").first.get_attribute("data-revision"))

    def drawn(self, after: int = 0, chart: str = ".df-main") -> None:
        """Wait until a chart is drawn anew with the case typed last; an empty chart waits for its first curve."""
        self.page.wait_for_function(
            """([chart, after]) => {
                const found = document.querySelector(chart + " .df-chart");
                const empty = document.querySelector(chart + " .df-waiting progress")?.checkVisibility();
                return found && Number(found.dataset.revision) > after && !found.classList.contains("stale") && !empty;
            }""",
            arg=[chart, after],
            polling=POLLING,
        )

    @contextlib.contextmanager
    def redrawn(self, chart: str = ".df-main") -> Iterator[None]:
        """Wait until what is done inside has been drawn."""
        before = self.revision(chart)
        yield
        self.drawn(before, chart)

    def grip(self, handle: Any) -> tuple[float, float, dict[str, float]]:
        """Press the mouse on the thumb of a slider; return where that is, and the slider's box. The form may move meanwhile."""
        while True:
            handle.hover()
            box = handle.bounding_box()
            low, high, value = (
                float(handle.evaluate(f"(one) => one.{name}")) for name in ("min", "max", "valueAsNumber")
            )
            # the thumb is 16 pixels wide, and stays within the box
            x, y = box["x"] + 8 + (box["width"] - 16) * (value - low) / (high - low), box["y"] + box["height"] / 2
            self.page.mouse.move(x, y)
            self.page.mouse.down()
            if handle.evaluate("(one) => one.matches(':active')"):
                return x, y, box
            self.page.mouse.up()

    def field(self, path: str) -> Any:
        """Return the field of a parameter of the case."""
        return self.page.locator(f'.df-entry[data-path="{path}"]')

    def parameter(self, path: str) -> Any:
        """Return all that stands at a parameter: its field, its slider and its fit."""
        return self.page.locator(".df-parameter").filter(has=self.field(path))

    def saved(self, text: str) -> None:
        """Wait until the server has written a text that was typed."""
        until = time.monotonic() + STARTING
        while not any(text in file.read_text() for file in (self.server.folder / "sessions").glob("*.json")):
            if time.monotonic() > until:
                raise TimeoutError(f"'{text}' was not kept")
            self.page.wait_for_timeout(50)

    def tab(self, name: str) -> None:
        """Go to a tab of the pane below the chart."""
        self.page.get_by_role("tab", name=name).click()

    def unfold(self) -> None:
        """Open all that the form keeps behind "More", and what it draws anew, too."""
        self.page.evaluate(
            """() => {
                const shut = ".df-form details:not([open])";
                const open = () => document.querySelectorAll(shut).forEach((one) => { one.open = true; });
                open();
                new MutationObserver(open).observe(document.body, {childList: true, subtree: true});
            }"""
        )

    def type(self, path: str, text: str) -> None:
        """Type into a field, as fast as a person does."""
        box = self.field(path).locator("input.df-box")
        box.fill(text)

    def traces(self, chart: str = ".df-main") -> list[dict[str, list[float]]]:
        """Return the numbers that a chart shows, line by line."""
        # as one text: Playwright takes arrays apart, number by number
        found = self.page.evaluate(
            """(chart) => JSON.stringify((document.querySelector(chart + " .df-plot")._fullData ?? []).map(
                ({name = null, meta = null, x, y}) => ({name, meta, x: Array.from(x), y: Array.from(y)})))""",
            chart,
        )
        traces = json.loads(found)
        for trace in traces:
            for along in "xy":  # in JSON a gap is null
                trace[along] = [math.nan if number is None else number for number in trace[along]]
        return traces

    def lines(self, quantity: str, chart: str = ".df-main") -> list[list[float]]:
        """Return the lines that a chart shows of a quantity, y alone."""
        return [trace["y"] for trace in self.traces(chart) if trace["meta"] == quantity]

    def click(self, trace: int, share: float) -> float:
        """Click on a line of the chart at a share of its points until it has a ring there; return where along x that is.

        A chart that is drawn anew between the pointer's coming and the click takes no note of it, and shows nothing under a
        pointer that rests.
        """
        shown = self.page.locator(".df-main .hoverlayer .legend").first
        until = time.monotonic() + STARTING
        while time.monotonic() < until:
            before = self.revision()
            along, is_ringed, place = self._point(trace, share)
            if is_ringed:
                return along
            self.page.mouse.move(place[0] + 1.0, place[1])
            self.page.mouse.move(*place)
            self.page.wait_for_timeout(HOVERING)
            if shown.is_visible():
                self.page.mouse.click(*place)
                self.drawn(before)
        raise TimeoutError("the chart does not take a click")

    def _point(self, trace: int, share: float) -> tuple[float, bool, tuple[float, float]]:
        """Return where along x a point of the chart is, whether it has a ring, and its place on the page at rest."""
        self.page.wait_for_function(  # what comes to stand below the chart makes it smaller
            """() => {
                const plot = document.querySelector(".df-main .df-plot");
                const before = plot.dataset.height;
                plot.dataset.height = plot.clientHeight;
                return before === plot.dataset.height;
            }""",
            polling=250,
        )
        along, is_ringed, *place = self.page.evaluate(
            """([number, share]) => {
                const plot = document.querySelector(".df-main .df-plot");
                const trace = plot._fullData[number];
                const place = Math.floor(trace.x.length * share), along = trace.x[place];
                const [x, y] = [trace.xaxis, trace.yaxis].map((name) => plot._fullLayout[name[0] + "axis" + name.slice(1)]);
                const box = plot.getBoundingClientRect();
                const ringed = (plot._fullLayout.shapes ?? []).some(
                    (one) => one.name === "clicked" && Math.abs(one.xanchor - along) < 1e-6 * Math.abs(along));
                return [along, ringed, box.left + x._offset + x.d2p(along), box.top + y._offset + y.d2p(trace.y[place])];
            }""",
            [trace, share],
        )
        return float(along), bool(is_ringed), tuple(place)

    def shows(self, case: df.Case) -> None:
        """Wait until the chart shows the amplitude and the phase of a case, number by number."""
        result = _result(case)
        while True:
            seen = self.revision()
            if all(_same(self.lines(name), result[name]) for name in ("amplitude", "phase")):
                return
            self.drawn(after=seen)

    def example(self, name: str) -> None:
        """Open an example from the menu."""
        title = df.examples()[name].title
        self.page.get_by_role("button", name="Examples").click()
        self.page.get_by_role("menuitem").filter(has=self.page.get_by_text(title, exact=True)).click()

    @contextlib.contextmanager
    def remade(self, patience: float | None = None) -> Iterator[None]:
        """Wait until the forms have been made anew after what is done inside."""
        self.page.evaluate(
            "() => document.querySelectorAll('.df-entry').forEach((one) => { one.dataset.before = true; })"
        )
        yield
        gone = "() => !document.querySelector('.df-entry[data-before]')"
        self.page.wait_for_function(gone, polling=POLLING, timeout=patience)

    def holds(self, case: df.Case) -> bool:
        """Return whether a case is there under its own title, without a mistake: who edits it changes the title."""
        wrong = self.page.locator(".df-error, .df-banner.wrong:not(.hidden)").count()
        return self.page.get_by_label("title of the case").input_value() == case.title and not wrong

    def open_example(self, name: str = "figure-3-air") -> df.Case:
        """Open an example, and return its case once its forms are there."""
        from playwright.sync_api import TimeoutError as Lost

        case = df.example(name)
        try:
            with self.remade(patience=20_000):
                self.example(name)
        except Lost:  # a press on a menu that is made anew under it: once more
            with self.remade():
                self.example(name)
        while not self.holds(case):  # the forms may have been made anew for what came before, too
            self.page.wait_for_timeout(POLLING)
        return case

    def start(self, name: str = "figure-3-air") -> df.Case:
        """Open an example, and return its case once amplitude and phase of its curves are drawn."""
        case = self.open_example(name)
        self.shows(case)
        return case


def violations(page: Any, *without: str, within: str | None = None) -> list[str]:
    """Return what axe-core finds in a part of the page, one line for each rule that is broken."""
    from axe_playwright_python.sync_playwright import Axe

    page.evaluate("() => Promise.all(document.getAnimations().map((one) => one.finished.catch(() => null)))")
    options = {"rules": {rule: {"enabled": False} for rule in without}, "resultTypes": ["violations"]}
    found = Axe().run(page, context=within, options=options).response["violations"]
    return [f"{one['id']}: {one['nodes'][0]['html'][:150]}" for one in found]


@functools.lru_cache(maxsize=64)
def _result(case: df.Case) -> Any:
    return df.run(case)


def _same(lines: list[list[float]], wanted: Any) -> bool:
    """Return whether lines hold the numbers wanted, one line for each direction and tone, in the unit of the reader.

    Lines have gaps at jumps.
    """
    numbers = np.moveaxis(wanted.values, wanted.dims.index("zc"), -1).reshape(-1, wanted.sizes["zc"])
    seen, meant = (
        [np.array(line)[np.isfinite(line)] for line in all_] for all_ in (lines, numbers / reader_unit(wanted)[0])
    )
    same = [len(line) for line in seen] == [len(line) for line in meant]
    return same and all(np.allclose(*pair, rtol=1e-6) for pair in zip(seen, meant, strict=True))
