"""Whether the accuracy that is asked for holds, and the estimated error is one: random cases against much finer ones.

    python benchmarks/accuracy.py [--cases 300] [--seed 15] [--family NAME ...] [--reference fine|engine] [--worst 10]
                                  [--method periodic|transient]

The cases come from the validation, half of them driven beside their resonance. Each is found at the default accuracy, and
again from the same state by the reference: RK4 with 16384 samples a period, or the engine. A deviation is the
largest over all quantities, as a share of each one's scale. Ctrl-C reports the comparisons so far; --family takes some of
the cases alone.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from ending import end_with

from dforce.checks.validation.comparison import reference
from dforce.checks.validation.draws import FAMILIES, Draw, draw
from dforce.core.stopping import until_stopped
from dforce.experiments.base import initial_motion
from dforce.observables.deviation import DEVIATIONS, deviations
from dforce.problem import Problem
from dforce.procedures.statuses import status_of
from dforce.results.status import Status
from dforce.solvers import SolverSettings
from dforce.solvers.block import Block
from dforce.solvers.problem_batch import ProblemBatch
from dforce.solvers.protocols import settle_at
from dforce.solvers.transient import Steady

FINE = 16_384  # samples a period of the reference by RK4
NOTHING = 3e-8  # below such an error neither the estimate nor the reference means anything
BESIDE = 2.0  # widths of the resonance, or a twentieth of its frequency, that a drive may lie beside it
FACTOR = 3.0  # within which an estimate is right


@dataclass(frozen=True)
class Outcome:
    """A case: its name, its status, estimated and true error, and the quantity in which that is met."""

    number: int
    family: str
    status: Status
    estimate: float
    error: float
    quantity: str


def beside(problem: Problem, number: int, seed: int) -> Problem:
    """Return every second problem driven beside its resonance."""
    rng = np.random.default_rng([seed, number, 1])
    if number % 2 == 0 or len(problem.tones) > 1:
        return problem
    f0, Q = problem.tones[0].frequency, problem.modes[0].Q
    return problem.at_frequency(f0 * (1.0 + rng.uniform(-1.0, 1.0) * min(BESIDE / Q, 0.05)))


def settled(problem: Problem, zc: float, settings: SolverSettings, near: Steady | None = None) -> Steady:
    """Return the steady motion at a distance."""
    block = Block.of_one(problem, settings, 10, lambda: None)
    start = initial_motion(block.integrator(0, zc), "free") if near is None else near.motion
    return settle_at(block, start, zc)


def compare(drawn: Draw, seed: int, settings: SolverSettings, exactly: str) -> Outcome | None:
    """Return the outcome of a case; None where its motion does not repeat with the tones, or has no reference."""
    number = drawn.number
    problem = beside(drawn.case.problem, number, seed)
    found = settled(problem, drawn.zc, settings)
    status, estimate = status_of(found, problem), float(found.values.get("error_estimate", np.nan))
    if np.isnan(estimate) and status != Status.OK:
        return None
    if exactly == "engine":
        orbit = reference(problem, drawn.zc, found.motion)
        exact = None if orbit is None else orbit.values
    else:
        exact = settled(problem, drawn.zc, SolverSettings(points_per_period=FINE), found).values
    if exact is None or "multiplier_modulus" not in exact:
        return None
    batch = ProblemBatch.of([problem])
    columns = [
        {name: np.asarray(one[name])[None] for name in DEVIATIONS if name in one} for one in (exact, found.values)
    ]
    off = deviations(problem, batch.numbers, batch.tones, *columns)[0]
    return Outcome(number, drawn.family, status, estimate, float(off.max()), DEVIATIONS[int(off.argmax())])


def right(one: Outcome) -> bool:
    """Say whether an estimate is right within the factor, or both are nothing."""
    if max(one.estimate, one.error) < NOTHING:
        return True
    return one.error / FACTOR < one.estimate < FACTOR * one.error


def low(one: Outcome) -> bool:
    """Say whether an estimate is too low."""
    return max(one.estimate, one.error) >= NOTHING and one.estimate < one.error / FACTOR


def report(outcomes: list[Outcome], asked: float, worst: int) -> None:
    """Print the figures, by family and in all."""
    groups: dict[str, list[Outcome]] = defaultdict(list)
    for one in outcomes:
        groups[one.family].append(one)
    print(f"{'forces':45s} cases  right  low  beyond  unflagged  largest")
    for name, some in [*sorted(groups.items()), ("all", outcomes)]:
        beyond = [one for one in some if one.error > asked]
        unflagged = [one for one in beyond if one.status == Status.OK]
        print(
            f"{name:45s} {len(some):5d}  {sum(map(right, some)):5d}  {sum(map(low, some)):3d}  {len(beyond):6d}  "
            f"{len(unflagged):9d}  {max((one.error for one in some), default=0.0):.1e}"
        )
    share = 100.0 / max(len(outcomes), 1)
    print(
        f"the estimate is right within a factor {FACTOR:g} in {share * sum(map(right, outcomes)):.0f} %, and too low in "
        f"{share * sum(map(low, outcomes)):.0f} %"
    )
    kinds = {status.name: sum(one.status == status for one in outcomes) for status in Status}
    print("status:", ", ".join(f"{name} {count}" for name, count in kinds.items() if count))
    print("off the most beyond the estimate:")
    for one in sorted(outcomes, key=lambda one: max(NOTHING, one.estimate) / max(one.error, NOTHING))[:worst]:
        print(
            f"  {one.number:4d} {one.family:42s} {one.status.name:10s} estimated {one.estimate:.1e}, off by {one.error:.1e}"
            f" in {one.quantity}"
        )


def main() -> None:
    """Compare, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=300)
    parser.add_argument("--seed", type=int, default=15)
    parser.add_argument("--accuracy", type=float, default=1e-4)
    parser.add_argument("--samples", type=int, help="fixed samples a period: nothing is found again")
    parser.add_argument("--family", nargs="*", default=list(FAMILIES))
    parser.add_argument("--method", choices=("periodic", "transient"), default="periodic")
    parser.add_argument("--reference", choices=("fine", "engine"), default="fine")
    parser.add_argument("--worst", type=int, default=10)
    given = parser.parse_args()
    settings = SolverSettings(accuracy=given.accuracy, method=given.method)
    if given.samples:
        settings = SolverSettings(points_per_period=given.samples, method=given.method)
    outcomes, left, start = [], 0, time.process_time()
    drawn = (draw(given.seed, number) for number in range(given.cases))
    with warnings.catch_warnings(action="ignore"), until_stopped() as stop:
        for case in (case for case in drawn if case.family in given.family):
            one = compare(case, given.seed, settings, given.reference)
            left += one is None
            outcomes += [] if one is None else [one]
    report(outcomes, given.accuracy, given.worst)
    print(f"{left} cases without a motion that repeats with the tones; {time.process_time() - start:.0f} s of CPU")
    if stop.came:
        raise KeyboardInterrupt


if __name__ == "__main__":
    end_with(main)
