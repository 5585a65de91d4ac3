"""The cost of accuracy: the time to a settled point against the error of its amplitude and phase, for each method.

    python benchmarks/cost_of_accuracy.py [--quick] [--plot FIG.png]

The reference is the engine at its tightest.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt

from dforce.case import Case, example
from dforce.core.units import show
from dforce.solvers import SolverSettings
from dforce.solvers.block import Block
from dforce.solvers.integrator import with_amplitudes
from dforce.solvers.protocols import settle_at

CASES = {"table-1-am": 4e-9, "figure-3-air": 5e-9}  # shipped cases, and the distance (m) of the point
POINTS = (64, 96, 128, 192, 256, 384, 512, 768, 1024, 2048)  # samples a period
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
LSODA_TOLERANCES = (1e-6, 1e-8, 1e-10)  # at coarser ones its own noise is too large to settle
SETTLED = 1e-9  # of the free amplitude, so that the rest of the transient does not count
REFERENCE = SolverSettings(method="transient", integrator="engine", relative_tolerance=1e-13, settle_tolerance=1e-12)
AMPLITUDE, PHASE = 1e-15, 1e-4  # m, degrees: the accuracy that the cheapest setting has to meet
PLENTY = 0.2  # s; longer work is timed once
LEAST = 1e-10  # nm, degrees: an error below it is drawn there
ERRORS = (("amplitude_error", 1e9, "amplitude error (nm)"), ("phase_error", 1.0, "phase error (°)"))


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


def costs(quick: bool) -> list[Cost]:
    """Time settled points by each method at coarse to fine settings, and compare them with a tight reference."""
    rows = []
    for name, zc in list(CASES.items())[: 1 if quick else None]:
        case = example(name)
        _, amplitude, phase = point(case, zc, REFERENCE)
        for method, setting, settings in ways(quick):
            found = point(case, zc, settings)
            taken = min([found[0]] + [point(case, zc, settings)[0] for _ in range(2 if found[0] < PLENTY else 0)])
            rows.append(Cost(name, method, setting, taken, abs(found[1] - amplitude), abs(found[2] - phase)))
    return rows


def ways(quick: bool) -> Iterator[tuple[str, float, SolverSettings]]:
    points, tolerances = (POINTS[2::3], TOLERANCES[1:4]) if quick else (POINTS, TOLERANCES)
    for method in ("periodic", "transient"):
        for count in points:
            yield (
                f"{method} rk4",
                count,
                SolverSettings(method=method, points_per_period=count, settle_tolerance=SETTLED),
            )
    for integrator in ("engine", "lsoda"):
        for tolerance in tolerances if integrator == "engine" else LSODA_TOLERANCES[: 1 if quick else None]:
            yield (
                f"transient {integrator}",
                tolerance,
                SolverSettings(
                    method="transient", integrator=integrator, relative_tolerance=tolerance, settle_tolerance=SETTLED
                ),
            )


def point(case: Case, zc: float, settings: SolverSettings) -> tuple[float, float, float]:
    """Return the time (s), the amplitude (m) and the phase (degrees) of a settled point; kernels are loaded before."""
    block = Block.of_one(case.problem, settings, 10, lambda: None)
    integrator = block.integrator(0, zc)
    motion = with_amplitudes(integrator, integrator.problem.free)
    integrator.lock_in(motion, 1)
    start = time.perf_counter()
    found = settle_at(block, motion, zc)
    return time.perf_counter() - start, float(found.values["amplitude"][0]), float(found.values["phase"][0])


def cheapest(rows: list[Cost]) -> Cost | None:
    """Return the row that meets the accuracy in the least time."""
    enough = [row for row in rows if row.amplitude_error <= AMPLITUDE and row.phase_error <= PHASE]
    return min(enough, key=lambda row: row.seconds) if enough else None


def draw(rows: list[Cost], path: Path) -> None:
    """Draw the errors against the time, a line for each method."""
    figure, both = plt.subplots(1, 2, figsize=(9.0, 4.0), layout="constrained")
    for axes, (name, scale, label) in zip(both, ERRORS, strict=True):
        for method in dict.fromkeys(row.method for row in rows):
            own = [row for row in rows if row.method == method]
            errors = [max(scale * getattr(row, name), LEAST) for row in own]
            axes.plot([1e3 * row.seconds for row in own], errors, marker="o", markersize=4, label=method)
        axes.set(xscale="log", yscale="log", xlabel="time to the settled point (ms)", ylabel=label)
    both[0].legend(frameon=False, fontsize="small")
    figure.savefig(path, dpi=160)


def main() -> None:
    """Time, print, and draw the first case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the first case alone, with three settings each")
    parser.add_argument("--plot", type=Path)
    options = parser.parse_args()
    rows = costs(options.quick)
    for row in rows:
        print(
            f"{row.case:14s} {row.method:20s} {row.setting:8g} {show(row.seconds, 's', 3):>10s} "
            f"{1e9 * row.amplitude_error:8.1e} nm {row.phase_error:8.1e} deg"
        )
    for case in dict.fromkeys(row.case for row in rows):
        best = cheapest([row for row in rows if row.case == case])
        found = f"{best.method} at {best.setting:g}, {show(best.seconds, 's', 3)}" if best else "none of these"
        print(f"{case}, amplitude to 1e-6 nm and phase to 1e-4 deg: {found}")
    if options.plot:
        draw([row for row in rows if row.case == rows[0].case], options.plot)


if __name__ == "__main__":
    main()
