"""The speed of a sweep, shown with its progress."""

from __future__ import annotations

import time

from dforce.experiments.base import Progress

LEAST = 1.0  # s before the first figure


def paced(progress: Progress) -> Progress:
    """Return a progress function that also shows the points per second since its first call."""
    begun, first = 0.0, -1

    def report(done: int, total: int, note: str) -> None:
        nonlocal begun, first
        if first < 0:
            begun, first = time.monotonic(), done
        seconds = time.monotonic() - begun
        rate = f"{(done - first) / seconds:.3g} points a second" if seconds > LEAST and done > first else ""
        progress(done, total, ", ".join(text for text in (note, rate) if text))

    return report
