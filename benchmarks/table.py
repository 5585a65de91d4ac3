"""Rows of a table of times, and the clock that fills them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

POINTS = 128  # samples a period in all comparisons of single periods
U = "u: RK4 by hand, Hertz"


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes
    ----------
    name
        The timed work.
    seconds
        The best of all repeats (s).
    spread
        Slowest over best repeat.
    ratio, to
        The best time, relative to the row named `to`; None without such a row.
    limit
        The ratio, or the time (s) where there is no ratio, that it is meant to stay below.
    """

    name: str
    seconds: float
    spread: float
    ratio: float | None = None
    to: str = ""
    limit: float | None = None


class Table:
    """Rows of a table, and the clock that fills them.

    Parameters
    ----------
    repeats
        The least number of times that a row is timed.
    budget
        Time (s) until which a row is timed again, since the best time of short work varies most.
    progress
        Called with the name of the next row.
    clock
        Returns the time (s).
    """

    def __init__(
        self, repeats: int, budget: float, progress: Callable[[str], None], clock: Callable[[], float]
    ) -> None:
        self.repeats, self.budget, self.progress, self.clock = repeats, budget, progress, clock
        self.rows: list[Row] = []

    def time(
        self, name: str, work: Callable[[], Any], count: int = 1, to: str = "", limit: float | None = None,
        repeats: int | None = None,
    ) -> None:  # fmt: skip
        """Add a row: the best time of `work` over `count` units of it, after one run that does not count.

        With `repeats` given it is timed so often.
        """
        self.progress(name)
        work()
        times: list[float] = []
        until = time.perf_counter() + (self.budget if repeats is None else 0.0)
        while len(times) < (repeats or self.repeats) or time.perf_counter() < until:
            start = self.clock()
            work()
            times.append(self.clock() - start)
        best = min(times) / count
        reference = next((row.seconds for row in self.rows if row.name == to), None)
        ratio = best / reference if reference else None
        self.rows.append(Row(name, best, max(times) / min(times), ratio, to if ratio else "", limit))
