"""Pictures of the window: `make screenshots` makes the pages' pictures, `--all` every tab, example and theme to look at."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

from served import Window, chromium, served

import dforce as df

TABS = ("Set point", "Fit", "Against", "Motion", "Numbers", "Advice")
WAIT = 120_000  # ms


def settled(window: Window) -> None:
    """Wait until nothing moves, and take the pointer away."""
    window.page.mouse.move(0, 400)
    window.page.wait_for_function(
        "() => document.getAnimations().every((one) => one.playState === 'finished' || one.effect.getTiming().iterations > 1)"
    )


def shown(window: Window, example: str) -> None:
    """Show an example, by a run where it takes long."""
    before = window.revision()
    window.example(example)
    window.page.wait_for_function(
        """(before) => Number(document.querySelector('.df-main .df-chart').dataset.revision) > before
            || [...document.querySelectorAll('.df-status')].some((one) => one.textContent.includes('press Run'))""",
        arg=before,
    )
    if window.revision() == before:
        window.page.get_by_role("button", name="Run").click()
        window.drawn(before)


def turn(window: Window, theme: str) -> None:
    """Take the light or the dark theme."""
    dark = window.page.evaluate("() => document.body.classList.contains('body--dark')")
    if dark != (theme == "dark"):
        window.page.get_by_role("button", name="Light or dark").click()


def for_pages(window: Window) -> Iterator[str]:
    """Give the names of the pictures of README and documentation, each when the window shows it."""
    click_curve(window, 0.29)
    yield "window"


def click_curve(window: Window, share: float) -> None:
    """Click on the first curve of the chart, at a share of its points, and hold the motion there in contact."""
    window.click(0, share)
    motion = window.page.locator(".df-motion[data-state='done']")
    motion.get_by_role("button", name="Pause").click()
    motion.get_by_label("place in the motion").evaluate(
        """(one) => {
            one.value = 0.353 * one.max;  // in contact
            one.dispatchEvent(new Event("input"));
        }"""
    )


def everything(window: Window) -> Iterator[str]:
    """Give the names of pictures of every tab and example in both themes."""
    for theme in ("light", "dark"):
        turn(window, theme)
        for tab in TABS:
            window.tab(tab)
            yield f"{theme}-tab-{tab.lower().replace(' ', '-')}"
        window.tab("Set point")
        for name in df.examples():
            shown(window, name)
            yield f"{theme}-example-{name}"


def main() -> None:
    """Make the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--all", action="store_true")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as kept, served(Path(kept)) as server, chromium() as browser:
        context = browser.new_context(viewport={"width": 1366, "height": 768})
        context.set_default_timeout(WAIT)
        window = Window(context.new_page(), server)
        window.open()
        for name in (everything if options.all else for_pages)(window):
            settled(window)
            window.page.screenshot(path=options.folder / f"{name}.png")
            print(name)


if __name__ == "__main__":
    main()
