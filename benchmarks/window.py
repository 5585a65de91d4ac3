"""Speed and cost of the window: a start, a slider in a real browser, wrong input, a class at once, many visits.

    python benchmarks/window.py [--people 30] [--seconds 60] [--visits 200]

Every time is from a person's action to the redrawn curves, computing included. Processor time counts all processes of the
server and the browser; unlike time by the clock it hardly depends on other work of the computer.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from many_users import CASE, FIELD, HIGH, LOW, answers, person_at
from served import Server, Window, chromium, served

import dforce as df
from dforce.gui.document.document import Document
from dforce.gui.window.address import to_link

MOVES = 30  # of the slider, one by one
TICKS = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100
SETTLING = 10.0  # s until abandoned work is given up
SWEEP, SWEEPS = 1.5, 4  # s; in more time there would be fewer values of the slider than redraws
ONE_BY_ONE = """async ([low, high, count]) => {
    const slider = document.querySelector('.df-slider[data-path="drive.A0"] input[type="range"]');
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
ENDS = """() => {
    const {min, max} = document.querySelector('.df-slider[data-path="drive.A0"] input[type="range"]');
    return [Number(min), Number(max)];
}"""
HELD = """async ([low, high, seconds]) => {
    const slider = document.querySelector('.df-slider[data-path="drive.A0"] input[type="range"]');
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
    // the curve shows the free amplitude far away: when did the slider show it?
    const lag = ([time, value]) => time - (said.find(([, other]) => other >= value - 0.002) ?? [time])[0];
    return [drawn.length / seconds, drawn.slice(1).map(lag)];
}"""


def descendants(pid: int) -> Iterator[int]:
    """Give a process and all that it started, as far as /proc shows them."""
    yield pid
    for file in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in file.read_text().split():
            yield from descendants(int(child))


def cpu_time(pids: set[int]) -> float:
    """Return the processor time (s) of processes."""
    spent = 0
    for pid in pids:
        try:
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        spent += int(fields[11]) + int(fields[12])
    return spent / TICKS


def slider(server: Server) -> None:
    """Print how soon a window is there, how quickly the curves follow a slider in a real browser, and the cost of a move."""
    with chromium() as browser:
        context = browser.new_context(viewport={"width": 1366, "height": 768})
        context.set_default_timeout(120_000)
        window = Window(context.new_page(), server)
        begun = time.perf_counter()
        window.go()
        window.page.locator(".df-start, .df-body").locator("visible=true").first.wait_for()
        print(f"first page, from the server's word that it is ready: {time.perf_counter() - begun:.1f} s")
        window.begin()
        window.drawn()
        print(f"first curve: {time.perf_counter() - begun:.1f} s")
        if not window.page.locator(".df-slider").count():
            window.page.locator(f'.df-entry[data-path="{FIELD}"] .df-slide').click()
        window.page.locator(".df-slider").wait_for()
        ends = window.page.evaluate(ENDS)
        low, high = max(LOW, ends[0]), min(HIGH, ends[1])  # beyond its ends a slider stays where it is
        window.page.evaluate(ONE_BY_ONE, [low, high, 5])  # not counted
        window.page.wait_for_timeout(5_000)  # compilation in the background is no part of a move
        ours = set(descendants(server.process.pid))
        theirs = set(descendants(os.getpid())) - ours - {os.getpid()}
        before = cpu_time(ours), cpu_time(theirs)
        times = window.page.evaluate(ONE_BY_ONE, [low, high, MOVES])
        taken = [1e3 * (cpu_time(pids) - spent) / MOVES for pids, spent in zip((ours, theirs), before, strict=True)]
        report("slider moved to curves redrawn, 221 points there and back", times)
        print(f"processor time of a move: server {taken[0]:.0f} ms, browser {taken[1]:.0f} ms")
        rates, lags = [], []
        for n in range(SWEEPS):
            window.type("tip.radius", f"{20.5 + 0.5 * n}")  # no curve of a sweep before is asked for again
            window.page.wait_for_timeout(1_000)
            rate, behind = window.page.evaluate(HELD, [low, high, SWEEP])
            rates.append(rate)
            lags += behind
        print(f"slider held down: {statistics.mean(rates):.1f} redraws a second")
        report("slider held down, how far the curves are behind", lags)


def wrong_input(server: Server) -> None:
    """Print how soon the window shows an error: of each field of a case, of files, and of links."""
    times: dict[str, list[float]] = {"field": [], "file": [], "link": []}
    with chromium() as browser:
        context = browser.new_context(viewport={"width": 1366, "height": 768})
        context.set_default_timeout(60_000)
        window = Window(context.new_page(), server)
        window.open()
        window.unfold()
        page, notes = window.page, window.page.locator(".q-notification")
        for box in page.locator(".df-form .df-entry input.df-box").locator("visible=true").all():
            before = box.input_value()
            begun = time.perf_counter()
            box.fill("7 bananas")
            page.locator(".df-form .df-error").first.wait_for()
            times["field"].append(1e3 * (time.perf_counter() - begun))
            box.fill(before)
            page.locator(".df-form .df-error").first.wait_for(state="detached")
        whole = df.write(df.run(df.example(CASE)), server.folder / "whole.nc").read_bytes()
        files = {
            "cut.nc": whole[: len(whole) // 2],
            "text.txt": b"colorless green ideas " * 999,
            "large.toml": bytes(60_000_000),
        }
        for name, content in files.items():
            (server.folder / name).write_bytes(content)
            begun = time.perf_counter()
            page.locator(".df-upload input[type=file]").set_input_files(server.folder / name)
            notes.first.wait_for()
            times["file"].append(1e3 * (time.perf_counter() - begun))
            notes.get_by_role("button", name="Close").first.click()
            notes.first.wait_for(state="detached")
        for link in ("colorless-green-ideas", to_link(Document.of(df.example(CASE)))[:-40]):
            begun = time.perf_counter()
            page.evaluate("(link) => { location.hash = link; }", link)
            notes.first.wait_for()
            times["link"].append(1e3 * (time.perf_counter() - begun))
            notes.get_by_role("button", name="Close").first.click()
            notes.first.wait_for(state="detached")
    for name, taken in times.items():
        report(f"wrong {name} to its sentence ({len(taken)} of them)", taken)


def memory(server: Server, visits: int) -> None:
    """Print the server's memory while people come and go."""

    async def come(first: int) -> None:
        for number in range(first, first + visits // 4):
            async with person_at(server, number) as person:
                await person.ask(6.0 + 0.01 * number)
                await asyncio.sleep(0.1)

    for quarter in range(4):
        asyncio.run(come(quarter * visits // 4))
        time.sleep(SETTLING)
        print(f"server memory after {(quarter + 1) * visits // 4} visits: {server.memory or 0.0:.0f} MB")


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
    parser.add_argument("--visits", type=int, default=200, help="0 leaves them out")
    options = parser.parse_args()
    print(
        f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
        if hasattr(os, "getloadavg")
        else f"{os.cpu_count()} cores"
    )
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder, served(Path(folder), CASE) as server:
        print(f"server ready: {time.perf_counter() - begun:.1f} s from the command")
        slider(server)
        wrong_input(server)
    if options.visits:
        with tempfile.TemporaryDirectory() as folder, served(Path(folder), CASE) as server:
            memory(server, options.visits)
    for measure in answers(options.people, options.seconds).measures():
        print(measure.name if measure.value is None else f"{measure.name}: {measure.value:.3g} {measure.unit}".rstrip())


if __name__ == "__main__":
    main()
