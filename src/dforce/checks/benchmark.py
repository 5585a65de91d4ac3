"""The time that a curve, a sweep and a first answer take on this machine."""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from dforce.case import Case, example
from dforce.checks.machine import machine
from dforce.core import child
from dforce.core.errors import checked
from dforce.maps import sweep
from dforce.results.status import whole
from dforce.runs import run

MODULI = {"sample.youngs_modulus": {"start": "0.1 GPa", "stop": "10 GPa", "points": 64, "spacing": "log"}}
NOTE = (
    "Each time is the best of its repeats. Points in contact cost more: compare only rows with the same share of them."
)
FIRST = "import dforce; dforce.run(dforce.example('table-1-am'))"


@dataclass(frozen=True)
class TimedRow:
    """One line of the table.

    Attributes
    ----------
    name
        The work that was timed.
    seconds
        The best time of all repeats (s).
    spread
        Slowest over best repeat.
    points
        Points that it computed; 0 for work that is no curve.
    in_contact
        Share of these points at which the tip touches the sample.
    """

    name: str
    seconds: float
    spread: float
    points: int = 0
    in_contact: float = 0.0


@checked
def benchmark(quick: bool = False, progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Time whole calls of a user: curves, a sweep, and the first answer of a new process.

    Parameters
    ----------
    quick
        Only curves, with few repeats: some seconds with compiled forces.
    progress
        Called with the name of the next measurement.

    Returns
    -------
    dict
        `rows`: a list of :class:`TimedRow` as dictionaries; `machine`; `note`.
    """
    repeats, report = 3 if quick else 7, progress or (lambda name: None)
    rows = [_timed(name, work, repeats, report) for name, work in _curves()]
    if not quick:
        stiffness = example("hysteresis").replace("experiment.zc.points", 41)
        rows.append(_timed("64 moduli on one core", lambda: whole(sweep(stiffness, MODULI, workers=1)), 1, report))
        rows.append(_timed("a new process, forces compiled before", partial(_process, None), 3, report))
        rows.append(_timed("a new process, nothing compiled before", _first, 1, report, warm=False))
    return {"rows": [asdict(row) for row in rows], "machine": machine(), "note": NOTE}


def _curves() -> list[tuple[str, Callable[[], xr.Dataset]]]:
    """Return curves by name, from never in contact to mostly in contact."""
    distances = {"start": "12 nm", "stop": "2 nm", "points": 201}
    far: Case = example("figure-3-air").replace("experiment.zc", distances)
    return [
        ("figure-3-air, approach and retract", lambda: whole(run(far))),
        ("hysteresis, approach and retract", lambda: whole(run(example("hysteresis")))),
    ]


def _timed(
    name: str, work: Callable[[], Any], repeats: int, report: Callable[[str], None], warm: bool = True
) -> TimedRow:
    """Time some work, after one run that does not count where `warm`."""
    report(name)
    result = work() if warm else None
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    touching = result.max_indentation.values > 0.0 if isinstance(result, xr.Dataset) else np.empty(0)
    share = float(touching.mean()) if touching.size else 0.0
    return TimedRow(name, min(times), max(times) / min(times), touching.size, share)


def _process(cache: str | None) -> None:
    """Compute one settled motion in a new process, with its own cache folder if `cache` is not None."""
    environment = child.environment() | ({"DFORCE_CACHE_DIR": cache} if cache else {})
    subprocess.run(child.command("-c", FIRST), check=True, capture_output=True, env=environment)


def _first() -> None:
    with tempfile.TemporaryDirectory() as cache:
        _process(cache)
