"""Many people at the window at once: the delay until each sees the curves of a new value, and the cost of a session."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import html
import http.cookies
import importlib.util
import json
import re
import statistics
import sys
import tempfile
import time
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from served import Server, served

CASE, FIELD = "figure-3-air", "drive.A0"
LOW, HIGH = 5.0, 9.0  # nm; amplitudes that the curve shows far away
NEAR = 2e-3  # nm; loss of amplitude by the surface far away
DRAWING = 0.03  # s that a browser takes to draw
CLOSING = 0.05  # s from a page's last word to the end of its connection
PAUSES = 1.0, 3.0  # s between two values of a person
PATIENCE = 10.0  # s for the last values
STARTING = 120.0  # s for the first curve, which may have to be compiled
NEEDED = ("nicegui", "plotly")
FEW = 5, 2.0  # people, seconds


@dataclass(frozen=True)
class Measure:
    """One line of the table.

    Attributes
    ----------
    name
        The measured quantity; or the reason for a missing number.
    value, unit
        The number, None where there is none, and its unit.
    """

    name: str
    value: float | None = None
    unit: str = ""


@dataclass(frozen=True)
class Answers:
    """Answers that people at the window have seen.

    Attributes
    ----------
    people, seconds
        How many at once, and how long they changed values.
    values
        Number of values seen as curves, without values that a newer one overtook.
    median, late, slowest
        Time from a value to its curves, computing and transport included (s): of half of them, of 95 %, of all.
    behind
        People who at last did not see the curves of their last value.
    memory
        The server's memory for each further session (MB); None where the system does not show it.
    """

    people: int
    seconds: float
    values: int
    median: float
    late: float
    slowest: float
    behind: int
    memory: float | None

    def measures(self) -> list[Measure]:
        """Return them as lines of a table."""
        which = f"the window, {self.people} people at once for {self.seconds:g} s"
        times = {"median": self.median, "95 % within": self.late, "the slowest": self.slowest}
        lines = [Measure(f"{which}: a value to its curves, {word}", taken, "s") for word, taken in times.items()]
        lines.append(Measure(f"{which}: people who did not see their last value", self.behind))
        return lines + [Measure(f"{which}: memory a session", self.memory, "MB")] * (self.memory is not None)


def measures(count: int, seconds: float) -> list[Measure]:
    """Return the delays for people at the window, as lines of a table; a line with the reason where there is no window."""
    try:
        return answers(count, seconds).measures()
    except Exception as error:  # of its libraries, too: the other rows took minutes  # noqa: BLE001
        return [Measure(f"the window: {str(error) or type(error).__name__}")]


def answers(count: int, seconds: float) -> Answers:
    """Start the window's server, and let many people change the free amplitude of figure 3 now and then.

    Each is a page without a browser: it speaks the page's protocol and answers as the page does.

    Raises
    ------
    RuntimeError
        When the server does not start, answers nobody, or lacks a package that it needs.
    """
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        raise RuntimeError(f"it needs {' and '.join(missing)}, which is not installed")
    with tempfile.TemporaryDirectory() as folder, served(Path(folder), CASE) as server, ThreadPoolExecutor(1) as thread:
        # in a notebook an event loop runs already
        return thread.submit(asyncio.run, _answers(server, count, seconds)).result()


async def _answers(server: Server, count: int, seconds: float) -> Answers:
    async with contextlib.AsyncExitStack() as stack:
        first = await stack.enter_async_context(person_at(server, 0))
        async with asyncio.timeout(STARTING):
            for value in np.linspace(LOW, HIGH, 5):
                await first.ask(float(value))
                while first.behind:
                    await asyncio.sleep(0.05)
        first.times.clear()
        before = server.memory  # modules that are loaded once are no part of a session
        others = [await stack.enter_async_context(person_at(server, seed)) for seed in range(1, count)]
        persons = [first, *others]
        await asyncio.gather(*(person.work(seconds) for person in persons))
        until = time.perf_counter() + PATIENCE
        while time.perf_counter() < until and any(person.behind for person in persons):
            await asyncio.sleep(0.05)
        after = server.memory
        times = sorted(taken for person in persons for taken in person.times)
        if not times:
            raise RuntimeError("no curve was seen in time")
        return Answers(
            count, seconds, len(times), statistics.median(times), times[int(0.95 * (len(times) - 1))], times[-1],
            sum(person.behind for person in persons),
            (after - before) / len(others) if others and after is not None and before is not None else None,
        )  # fmt: skip


class Person:
    """One page without a browser."""

    def __init__(self, server: Server, seed: int) -> None:
        self.server, self.random = server, np.random.default_rng(seed)
        self.times: list[float] = []  # s
        self.asked: dict[float, float] = {}  # when each value was typed
        self.shown = self.last = 0.0  # nm
        self.heard = 0  # messages

    async def open(self) -> None:
        """Load the page and connect."""
        import aiohttp

        jar = aiohttp.CookieJar(unsafe=True)  # cookies of an address without a name, too
        async with aiohttp.ClientSession(cookie_jar=jar) as session, session.get(self.server.address) as answer:
            page = await answer.text()
        elements: dict[str, Any] = json.loads(html.unescape(_found(r"String\.raw`(.*?)`\)", page)))
        self.client = _found(r"client_id['\"]: ['\"]([^'\"]+)", page)
        props = {int(key): one.get("props", {}) for key, one in elements.items()}
        self.chart = next(key for key, one in props.items() if one.get("label") == "result")
        self.field = next(
            key for key, one in props.items() if one.get("path") == FIELD and one.get("kind", "text") == "text"
        )
        self.listener = _listener(elements[str(self.field)], "typed")
        self.leaving = _listener(elements["0"], "left")
        self.cookies = http.cookies.SimpleCookie({cookie.key: cookie.value for cookie in jar})
        await self.connect()

    async def connect(self) -> None:
        """Connect, for the first time or after the connection was cut.

        Raises
        ------
        RuntimeError
            When the server does not know the page, or no longer.
        """
        import socketio

        self.socket = socketio.AsyncClient(reconnection=False)
        self.socket.on("*", self.hear)
        await self.socket.connect(
            f"{self.server.home}/?client_id={self.client}",
            headers={"Cookie": self.cookies.output(header="", sep=";").strip()},
            socketio_path="/_nicegui_ws/socket.io", transports=["websocket"],
        )  # fmt: skip
        names = {name: f"{name}-{self.client}" for name in ("document_id", "tab_id", "old_tab_id")}
        if not await self.socket.call("handshake", {"client_id": self.client, **names}):
            raise RuntimeError("the server does not know its own page")

    async def hear(self, event: str, message: Any = None, *_: Any) -> None:
        """Take a message of the server."""
        if isinstance(message, dict):
            self.heard = max(self.heard, message.get("_id", -1) + 1)
        if event == "run_javascript":
            await self.answer(message)

    async def answer(self, message: dict[str, Any]) -> None:
        """Answer the server's requests to a page; note the contents of figures."""
        drawn = re.match(r'return runMethod\((\d+), "draw", (.*)\)$', message["code"], re.DOTALL)
        revision = None
        if drawn:
            figure, revision = json.loads(drawn[2])[:2]
            if int(drawn[1]) == self.chart:
                await asyncio.sleep(DRAWING)
                self.see(figure)
        if "request_id" in message and self.socket.connected:  # who leaves while the page draws answers nobody
            response = {"request_id": message["request_id"], "client_id": self.client, "result": revision}
            await self.socket.emit("javascript_response", response)

    def see(self, figure: dict[str, Any]) -> None:
        """Note the free amplitude that a figure shows, and how long ago it was typed."""
        if not figure["data"]:  # there is no curve yet
            return
        values = np.frombuffer(base64.b64decode(figure["data"][0]["y"]["bdata"]))
        self.shown = float(values.max())
        since = next((since for asked, since in self.asked.items() if abs(asked - self.shown) < NEAR), None)
        if since is not None:
            self.times.append(time.perf_counter() - since)
            self.asked = {asked: other for asked, other in self.asked.items() if other > since}

    @property
    def behind(self) -> bool:
        """Whether the curves seen belong to an earlier value."""
        return abs(self.shown - self.last) > NEAR

    async def ask(self, value: float) -> None:
        """Type a value, and note when."""
        self.last = value
        self.asked[value] = time.perf_counter()
        await self.type(f"{value}")

    async def type(self, text: str) -> None:
        """Type a text into the field."""
        await self.emit(self.field, self.listener, json.dumps({"text": text, "unit": "nm"}))
        # the server keeps messages that a page has not confirmed
        await self.socket.emit("ack", {"client_id": self.client, "next_message_id": self.heard})

    async def leave(self) -> None:
        """Close the page."""
        await self.emit(0, self.leaving)
        await asyncio.sleep(CLOSING)
        await self.socket.disconnect()

    async def emit(self, element: int, listener: str, *arguments: str) -> None:
        """Send an element's event to the server."""
        event = {"id": element, "client_id": self.client, "listener_id": listener, "args": arguments}
        await self.socket.emit("event", event)

    async def work(self, seconds: float) -> None:
        """Change the value now and then."""
        until = time.perf_counter() + seconds
        await asyncio.sleep(float(self.random.uniform(0.0, min(PAUSES))))  # they do not begin together
        while time.perf_counter() < until:
            await self.ask(round(float(self.random.uniform(LOW, HIGH)), 2))
            await asyncio.sleep(min(float(self.random.uniform(*PAUSES)), max(0.0, until - time.perf_counter())))


@contextlib.asynccontextmanager
async def person_at(server: Server, seed: int) -> AsyncIterator[Person]:
    """Give a person with the page open, and let them leave."""
    person = Person(server, seed)
    await person.open()
    try:
        yield person
    finally:
        await person.leave()


def _listener(element: dict[str, Any], kind: str) -> str:
    """Return the identifier under which the server listens to an element."""
    return str(next(event["listener_id"] for event in element["events"] if event["type"] == kind))


def _found(pattern: str, page: str) -> str:
    """Return the text of a page at a pattern."""
    match = re.search(pattern, page, re.DOTALL)
    if match is None:
        raise RuntimeError(f"the page that the server gave has no {pattern}")
    return match[1]
