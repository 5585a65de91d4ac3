"""How quickly the window answers: a slider in a real browser, and a class of people at once.

    python benchmarks/window.py [--people 30] [--seconds 60]

Every time is from what a person does to the redrawn curves, computing included.
"""

from __future__ import annotations

import argparse
import asyncio
import base64
import html
import http.cookies
import json
import os
import re
import statistics
import sys
import tempfile
import time
import urllib.parse
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from served import Server, Window, chromium, served

CASE = "figure-3-air"
FIELD = "drive.A0"
NEAR = 2e-3  # nm; what the surface takes of the amplitude far away
ONE_BY_ONE = """async ([low, high, count]) => {
    const slider = document.querySelector('.df-slider input[type="range"]');
    const chart = document.querySelector('.df-main .df-chart');
    const times = [];
    for (let n = 0; n < count; n++) {
        const before = Number(chart.dataset.revision);
        const begun = performance.now();
        slider.value = low + ((high - low) * (n + 1)) / count;
        slider.dispatchEvent(new Event('input'));
        while (Number(chart.dataset.revision) === before) await new Promise((then) => requestAnimationFrame(then));
        times.push(performance.now() - begun);
        await new Promise((then) => setTimeout(then, 300));
    }
    return times;
}"""
HELD = """async ([low, high, seconds]) => {
    const slider = document.querySelector('.df-slider input[type="range"]');
    const chart = document.querySelector('.df-main .df-chart');
    const plot = document.querySelector('.df-main .df-plot');
    const [said, drawn] = [[], []];
    let seen = Number(chart.dataset.revision);
    const begun = performance.now();
    for (let now = begun; now - begun < seconds * 1000; now = await new Promise((then) => requestAnimationFrame(then))) {
        slider.value = low + ((high - low) * (now - begun)) / (seconds * 1000);
        said.push([now, slider.valueAsNumber]);
        slider.dispatchEvent(new Event('input'));
        if (Number(chart.dataset.revision) !== seen) {
            seen = Number(chart.dataset.revision);
            drawn.push([performance.now(), Math.max(...plot._fullData[0].y)]);
        }
    }
    // the free amplitude is what the curve shows far away: when did the slider say it?
    const lag = ([time, value]) => time - (said.find(([, other]) => other >= value - 0.002) ?? [time])[0];
    return [drawn.length / seconds, drawn.slice(1).map(lag)];
}"""


def slider(server: Server) -> None:
    """Print how quickly the curves follow a slider in a real browser."""
    with chromium() as browser:
        context = browser.new_context(viewport={"width": 1366, "height": 768})
        context.set_default_timeout(60_000)
        window = Window(context.new_page(), server)
        window.open()
        window.page.locator(f'.df-entry[data-path="{FIELD}"] .df-slide').click()
        window.page.locator(".df-slider").wait_for()
        window.page.evaluate(ONE_BY_ONE, [6.0, 8.0, 5])  # not counted
        times = window.page.evaluate(ONE_BY_ONE, [5.0, 9.0, 30])
        report("slider moved to curves redrawn, 221 points there and back", times)
        rate, lags = window.page.evaluate(HELD, [5.0, 9.0, 5.0])
        print(f"slider held down: {rate:.1f} redraws a second")
        report("slider held down, how far the curves are behind", lags)


class Person:
    """One page without a browser: speaks the protocol of the page, and answers as the page does."""

    def __init__(self, server: Server, seed: int) -> None:
        self.server, self.random = server, np.random.default_rng(seed)
        self.socket: Any = None
        self.times: list[float] = []
        self.asked: dict[float, float] = {}
        self.shown = 0.0
        self.last = 0.0

    async def open(self, session: Any) -> None:
        """Load the page and connect."""
        import socketio

        # the name of this computer need not lead to it here
        async with session.get(self.server.address.replace(host_of(self.server), "127.0.0.1", 1)) as answer:
            page = await answer.text()
        cookies = {cookie.key: cookie.value for cookie in session.cookie_jar}
        elements = json.loads(html.unescape(re.search(r"String\.raw`(.*?)`\)", page, re.DOTALL)[1]))
        self.client = re.search(r"client_id['\"]: ['\"]([^'\"]+)", page)[1]
        entry, self.events = next(
            (int(key), one["events"]) for key, one in elements.items() if one.get("props", {}).get("path") == FIELD
            and one["props"].get("kind", "text") == "text"
        )  # fmt: skip
        self.field = entry
        self.chart = next(int(key) for key, one in elements.items() if one.get("props", {}).get("label") == "result")
        self.socket = socketio.AsyncClient(reconnection=False)
        self.socket.on("run_javascript", self.asked_by_server)
        header = http.cookies.SimpleCookie(cookies).output(header="", sep=";").strip()
        await self.socket.connect(
            f"http://127.0.0.1:{self.server.port}/?client_id={self.client}", headers={"Cookie": header},
            socketio_path="/_nicegui_ws/socket.io", transports=["websocket"],
        )  # fmt: skip
        names = {name: f"{name}-{self.client}" for name in ("document_id", "tab_id", "old_tab_id")}
        if not await self.socket.call("handshake", {"client_id": self.client, **names}):
            raise RuntimeError("the server does not know this page")

    async def asked_by_server(self, message: dict[str, Any]) -> None:
        """Answer what the server asks of a page; of figures, note what they show."""
        code, answer = message["code"], None
        if match := re.match(r'return runMethod\((\d+), "draw", (.*)\)$', code, re.DOTALL):
            figure, revision = json.loads(match[2])[:2]
            answer = revision
            if int(match[1]) == self.chart:
                await asyncio.sleep(0.03)  # what a browser takes to draw
                self.see(figure)
        if "request_id" in message:
            response = {"request_id": message["request_id"], "client_id": self.client, "result": answer}
            await self.socket.emit("javascript_response", response)

    def see(self, figure: dict[str, Any]) -> None:
        """Note the free amplitude that a figure shows, and how long ago it was typed."""
        if not figure["data"]:  # there is no curve yet
            return
        values = np.frombuffer(base64.b64decode(figure["data"][0]["y"]["bdata"]))
        self.shown = float(values.max())
        since = next((since for asked, since in self.asked.items() if abs(asked - self.shown) < NEAR), None)
        if since is not None:
            self.times.append(1e3 * (time.perf_counter() - since))
            self.asked = {asked: other for asked, other in self.asked.items() if other > since}

    async def close(self) -> None:
        """Leave."""
        if self.socket is not None:
            await self.socket.disconnect()

    async def work(self, seconds: float) -> None:
        """Change the amplitude now and then, as a person with a slider does."""
        listener = next(event["listener_id"] for event in self.events if event["type"] == "typed")
        until = time.perf_counter() + seconds
        while time.perf_counter() < until:
            self.last = round(float(self.random.uniform(5.0, 9.0)), 2)
            self.asked[self.last] = time.perf_counter()
            arguments = {"text": f"{self.last}", "unit": "nm"}
            message = {
                "id": self.field,
                "client_id": self.client,
                "listener_id": listener,
                "args": [json.dumps(arguments)],
            }
            await self.socket.emit("event", message)
            await asyncio.sleep(float(self.random.uniform(1.0, 3.0)))


async def people(server: Server, count: int, seconds: float) -> None:
    """Print how a server answers many people at once."""
    import aiohttp

    persons = [Person(server, seed) for seed in range(count)]
    sessions = [aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True)) for _ in persons]
    try:
        for number, (person, session) in enumerate(zip(persons, sessions, strict=True)):
            await person.open(session)
            if number == 0:
                await person.work(5.0)  # what is loaded once is no part of a session
                before = memory(server)
                person.times.clear()
        await asyncio.gather(*(person.work(seconds) for person in persons))
        until = time.perf_counter() + 10.0
        while time.perf_counter() < until and any(abs(one.shown - one.last) > NEAR for one in persons):
            await asyncio.sleep(0.1)
        behind = sum(abs(one.shown - one.last) > NEAR for one in persons)
        report(f"{count} people for {seconds:.0f} s: typed to curves", [time for one in persons for time in one.times])
        print(f"people whose last value was not shown: {behind} of {count}")
        if before and count > 1:
            print(f"memory of the server: {(memory(server) - before) / (count - 1):.2f} MB a session")
    finally:
        for person in persons:
            await person.close()
        for session in sessions:
            await session.close()


def host_of(server: Server) -> str:
    """Return the name that the server printed."""
    return urllib.parse.urlsplit(server.address).hostname or ""


def memory(server: Server) -> float:
    """Return the memory of a server (MB), 0 where the system does not tell."""
    status = Path(f"/proc/{server.process.pid}/status")
    found = re.search(r"VmRSS:\s+(\d+)", status.read_text()) if status.exists() else None
    return int(found[1]) / 1024 if found else 0.0


def report(name: str, times: list[float]) -> None:
    """Print a distribution of times (ms)."""
    if not times:
        print(f"{name}: none")
        return
    ordered = sorted(times)
    late = ordered[min(len(ordered) - 1, int(0.95 * len(ordered)))]
    print(f"{name}: median {statistics.median(ordered):.0f} ms, 95 % below {late:.0f} ms, worst {ordered[-1]:.0f} ms")


def main() -> None:
    """Time the window."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=int, default=30)
    parser.add_argument("--seconds", type=float, default=60.0)
    options = parser.parse_args()
    print(
        f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
        if hasattr(os, "getloadavg")
        else f"{os.cpu_count()} cores"
    )
    with tempfile.TemporaryDirectory() as folder:
        with served(Path(folder) / "alone", CASE) as server:
            slider(server)
        with served(Path(folder) / "class", CASE, "--host", "0.0.0.0") as server:
            asyncio.run(people(server, options.people, options.seconds))


if __name__ == "__main__":
    main()
