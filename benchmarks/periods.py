"""The cost of one period of motion, beside loops written by hand for the same case.

    python benchmarks/periods.py [--quick] [--json]

u is one period of the loop written by hand for a Hertz contact (RK4, 128 samples). A limit is an upper bound of the ratio.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from dataclasses import asdict
from functools import partial
from typing import Any

import handwritten as hand
import numpy as np
from table import POINTS, Table, U

from dforce.case import Case, example
from dforce.checks.machine import machine
from dforce.core.units import show
from dforce.problem import Problem
from dforce.solvers.block import Block
from dforce.solvers.integrator import INTEGRATORS, Integrator, Motion, with_amplitudes
from dforce.solvers.problem_batch import ProblemBatch
from dforce.solvers.states import States

CASE = "table-1-am"
PERIODS = 400
LANES, LANE_PERIODS = 256, 50  # cases side by side, and periods of them
DMT, VISCOUS = {"model": "dmt", "hamaker": 2e-20}, {"model": "kelvin_voigt", "viscosity": 10.0}
THIRD: tuple[dict[str, Any], ...] = (
    {"model": "hydration", "energy": 1e-3, "decay": 3e-10}, {"model": "electrostatic"}, {"model": "magnetic_dipole"},
)  # fmt: skip
LAWS: tuple[tuple[str, list[dict[str, Any]], float | None], ...] = (
    ("Hertz", [{"model": "hertz"}], 0.05),
    ("van der Waals", [{"model": "van_der_waals", "hamaker": 2e-20}], None),
    ("DMT", [DMT], None),
    ("hydration", [{"model": "hydration"}], None),
    ("electrostatic", [{"model": "electrostatic"}], None),
    ("DMT + Kelvin–Voigt", [DMT, VISCOUS], 0.15),
)


def ready(case: Case, zc: float) -> tuple[Integrator, Motion]:
    """Return an integrator at a distance and the free motion, its kernel compiled."""
    solver = case.solver.replace(method="transient", points_per_period=POINTS)
    integrator = INTEGRATORS[solver.integrator](case.problem, solver, 10)
    integrator.place(zc)
    return integrator, with_amplitudes(integrator, integrator.problem.free)


def single(table: Table, quick: bool) -> None:
    """Time one period of a single motion, by hand and composed."""
    case = example(CASE)
    problem, zc = case.problem, case.experiment.zc
    mode, tone = problem.modes[0], problem.tones[0]
    length, g, unit = tone.A0, 1.0 / mode.Q, mode.k * tone.A0
    scaled = problem.forces[0].numbers()[0] * length**1.5 / unit
    cosine, sine = hand.tables(POINTS)
    surface = (zc - problem.a0) / length
    table.time(U, lambda: hand.hertz(surface, scaled, g, cosine, sine, POINTS, PERIODS), PERIODS)
    surfaces, x, v = np.full(hand.LANES, surface), np.zeros(hand.LANES), np.zeros(hand.LANES)
    side_by_side = partial(hand.hertz_lanes, surfaces, scaled, g, cosine, POINTS, PERIODS, x, v)
    table.time("by hand, 16 cases side by side, each", side_by_side, PERIODS * hand.LANES, U)
    sticky = case.replace("forces", [DMT, VISCOUS])
    elastic, attraction, adhesion, a0 = sticky.problem.forces[0].numbers()
    drag = 10.0 * (2e-9 * length) ** 0.5 * 2.0 * np.pi * tone.frequency * length / unit
    law = (a0 / length, elastic * length**1.5 / unit, attraction / (length**2 * unit), adhesion / unit, drag)
    by_hand = partial(hand.dmt_kelvin_voigt, zc / length, law, g, cosine, POINTS, PERIODS)
    table.time("RK4 by hand, DMT + Kelvin–Voigt", by_hand, PERIODS, U)
    composed: dict[str, tuple[Case, float | None]] = {
        "composed RK4, Hertz": (case, None), "composed RK4, DMT + Kelvin–Voigt": (sticky, 2.0),
    }  # fmt: skip
    for third in () if quick else THIRD:
        more = case.replace("forces", [DMT, VISCOUS, third])
        composed[f"composed RK4, DMT + Kelvin–Voigt + {third['model']}"] = more, 1.3
    for name, (chosen, limit) in composed.items():
        integrator, motion = ready(chosen, zc)
        table.time(name, partial(integrator.lock_in, motion, PERIODS), PERIODS, U, limit)


def several(table: Table, count: int) -> None:
    """Time several forces at once against the sum of a run with each."""
    names = ("electrostatic", "hydration", "capillary")
    forces = [DMT, VISCOUS, *({"model": name} for name in names)][:count]
    case = example(CASE).replace("cantilever.k", 5.0)
    zc = case.experiment.zc
    runs = [ready(case.replace("forces", [force]), zc) for force in forces]
    each = f"{count} runs, a force each"
    table.time(each, lambda: [integrator.lock_in(motion, PERIODS) for integrator, motion in runs], PERIODS, U)
    integrator, motion = ready(case.replace("forces", forces), zc)
    table.time(f"one run, {count} forces", partial(integrator.lock_in, motion, PERIODS), PERIODS, each, 1.5)


def lanes(table: Table) -> None:
    """Time a period in vector lanes for each law: divisions, roots and exponentials make the difference."""
    for label, forces, limit in LAWS:
        case = example(CASE).replace("forces", forces)
        batch = ProblemBatch.of([case.problem] * LANES)
        block = Block(batch, partial(same, case.problem), case.solver, 1, POINTS, lambda: None)
        nothing, zc = np.empty((LANES, 0)), np.full(LANES, case.experiment.zc)
        work = partial(block.advance, np.arange(LANES), States(batch.free(), nothing, nothing), zc, LANE_PERIODS)
        table.time(f"in lanes, {LANES} cases on one core, {label}", work, LANE_PERIODS * LANES, U, limit)


def same(problem: Problem, _: int, zc: float) -> tuple[Problem, float]:
    """Return the only problem of a block, at a distance (m)."""
    return problem, zc


def main() -> None:
    """Time, and print a line for each row."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few repeats and few forces")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    table = Table(*((3, 0.02) if options.quick else (7, 0.2)), lambda name: None, time.process_time)
    single(table, options.quick)
    several(table, 2 if options.quick else 5)
    if not options.quick:
        lanes(table)
    if options.json:
        print(json.dumps({"rows": [asdict(row) for row in table.rows], "machine": machine()}))
        return
    for row in table.rows:
        ratio = math.nan if row.ratio is None else row.ratio
        limit = "" if row.limit is None else f"  below {row.limit:g}"
        print(
            f"{row.name:60s} {show(row.seconds, 's', 3):>10s}  {ratio:6.3g} x {row.to}{limit}  spread {row.spread:.2f}"
        )
    print(", ".join(f"{key} {value}" for key, value in machine().items()))


if __name__ == "__main__":
    main()
