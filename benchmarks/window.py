"""How quickly the window answers: a slider in a real browser, and a class of people at once.

    python benchmarks/window.py [--people 30] [--seconds 60]

Every time is from what a person does to the redrawn curves, computing included.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from many_users import CASE, FIELD, HIGH, LOW, answers
from served import Server, Window, chromium, served

SWEEP, SWEEPS = 1.5, 4  # s; in more time there would be fewer values of the slider than redraws
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
        times = window.page.evaluate(ONE_BY_ONE, [LOW, HIGH, 30])
        report("slider moved to curves redrawn, 221 points there and back", times)
        rates, lags = [], []
        for _ in range(SWEEPS):
            rate, behind = window.page.evaluate(HELD, [LOW, HIGH, SWEEP])
            rates.append(rate)
            lags += behind
            window.page.wait_for_timeout(500)
        print(f"slider held down: {statistics.mean(rates):.1f} redraws a second")
        report("slider held down, how far the curves are behind", lags)


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
    with tempfile.TemporaryDirectory() as folder, served(Path(folder), CASE) as server:
        slider(server)
    for measure in answers(options.people, options.seconds).measures():
        print(f"{measure.name}: {measure.value} {measure.unit}")


if __name__ == "__main__":
    main()
