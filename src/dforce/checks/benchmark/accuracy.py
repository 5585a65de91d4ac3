"""What accuracy costs: the time to a settled point against the error of its amplitude and phase, for each method."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

from dforce.case import Case, example
from dforce.core.errors import checked
from dforce.solvers import SolverSettings
from dforce.solvers.block import Block
from dforce.solvers.integrator import free_amplitudes, with_amplitudes
from dforce.solvers.protocols import settle_at

CASES = {"table-1-am": 4e-9, "figure-3-air": 5e-9}  # shipped cases, and the distance (m) of the point
POINTS = (64, 96, 128, 192, 256, 384, 512, 768, 1024, 2048)  # samples a period
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
LSODA_TOLERANCES = (1e-6, 1e-8, 1e-10)  # at coarser ones its own noise is too large to settle
SETTLED = 1e-9  # of the free amplitude, so that what is left of the transient does not count
REFERENCE = SolverSettings(
    method="transient", integrator="adaptive", relative_tolerance=1e-13, points_per_period=512, settle_tolerance=1e-12
)
AMPLITUDE, PHASE = 1e-15, 1e-4  # m, degrees: the accuracy for which the cheapest setting is told
PLENTY = 0.2  # s; what takes longer is timed once


@dataclass(frozen=True)
class Cost:
    """One way to a settled point.

    Attributes
    ----------
    case, method, setting
        The shipped case; ``periodic rk4``, ``transient rk4``, ...; samples a period, or the tolerance of a step.
    seconds
        Time from the motion without forces to all observables of the settled one (s), the best of three.
    amplitude_error, phase_error
        Differences from the reference (m, degrees), positive.
    """

    case: str
    method: str
    setting: float
    seconds: float
    amplitude_error: float
    phase_error: float


@checked
def cost_of_accuracy(quick: bool = False, progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Time settled points by each method at coarse to fine settings, and compare them with a tight reference.

    Parameters
    ----------
    quick
        The first case alone with three settings each.
    progress
        Called with the name of what is timed next.

    Returns
    -------
    dict
        `rows`: a list of :class:`Cost` as dictionaries; `cheapest`: for each case the one that needs least time for an
        amplitude to 1e-6 nm and a phase to 1e-4 degrees, or None; `reference`: amplitude (m) and phase (degrees) by case.
    """
    rows: list[Cost] = []
    reference = {}
    for name, zc in list(CASES.items())[: 1 if quick else None]:
        case = example(name)
        exact = _point(case, zc, REFERENCE)[1:]
        reference[name] = exact
        for method, setting, settings in _ways(quick):
            if progress is not None:
                progress(f"{name}, {method}, {setting:g}")
            taken, amplitude, phase = _point(case, zc, settings)
            taken = min([taken] + [_point(case, zc, settings)[0] for _ in range(2 if taken < PLENTY else 0)])
            rows.append(Cost(name, method, setting, taken, abs(amplitude - exact[0]), abs(phase - exact[1])))
    cheapest = {name: _cheapest([row for row in rows if row.case == name]) for name in reference}
    return {"rows": [asdict(row) for row in rows], "cheapest": cheapest, "reference": reference}


def _ways(quick: bool) -> Iterator[tuple[str, float, SolverSettings]]:
    points, tolerances = (POINTS[2::3], TOLERANCES[1:4]) if quick else (POINTS, TOLERANCES)
    for method in ("periodic", "transient"):
        for count in points:
            yield (
                f"{method} rk4",
                count,
                SolverSettings(method=method, points_per_period=count, settle_tolerance=SETTLED),
            )
    for integrator in ("adaptive", "lsoda"):
        for tolerance in tolerances if integrator == "adaptive" else LSODA_TOLERANCES[: 1 if quick else None]:
            yield (
                f"transient {integrator}",
                tolerance,
                SolverSettings(
                    method="transient", integrator=integrator, relative_tolerance=tolerance, settle_tolerance=SETTLED
                ),
            )


def _point(case: Case, zc: float, settings: SolverSettings) -> tuple[float, float, float]:
    """Return the time (s), the amplitude (m) and the phase (degrees) of a settled point; kernels are loaded before."""
    block = Block.of_one(case.problem, settings, 10, lambda: None)
    integrator = block.integrator(0, zc)
    motion = with_amplitudes(integrator, free_amplitudes(integrator))
    integrator.lock_in(motion, 1)
    start = time.perf_counter()
    found = settle_at(block, motion, zc)
    return time.perf_counter() - start, float(found.values["amplitude"][0]), float(found.values["phase"][0])


def _cheapest(rows: list[Cost]) -> dict[str, Any] | None:
    enough = [row for row in rows if row.amplitude_error <= AMPLITUDE and row.phase_error <= PHASE]
    return asdict(min(enough, key=lambda row: row.seconds)) if enough else None
