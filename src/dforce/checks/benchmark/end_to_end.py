"""What whole calls cost: curves, maps and basins as a user asks for them, and each law in vector lanes."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from dforce.case import Case, example
from dforce.checks.benchmark.table import POINTS, Row, Table, U
from dforce.maps import sweep
from dforce.problem import Problem
from dforce.runs import basins, run
from dforce.solvers.block import Block
from dforce.solvers.problem_batch import Lot
from dforce.solvers.states import States

DISTANCES = 201
CURVE = "figure 3, a curve by df.run, each of 201 distances"
LSODA_PYTHON = "LSODA over Python, Hertz"
PAPER = "figure 3 by the paper's method, each distance"
DECAYS = 5.0  # times Q / pi periods at each distance: the paper says two to five
LANES, PERIODS = 256, 50  # cases side by side, and periods of them


def curves(table: Table, quick: bool) -> None:
    """Time curves of figure 3 with every observable, one alone and many together."""
    case = example("figure-3-air").replace("experiment.direction", "approach")
    case = case.replace("experiment.zc", {"start": "12 nm", "stop": "2 nm", "points": DISTANCES})
    table.time(CURVE, lambda: run(case), DISTANCES, U, 6.0)
    both = example("hysteresis").replace("experiment.zc.points", DISTANCES)
    jumps = "the example hysteresis, approach and retract with jumps at folds, each distance"
    table.time(jumps, lambda: run(both), 2 * DISTANCES, U, 8.0)
    calm = "figure 3 at Q = 100, each distance"
    dull, sharp = (case.replace("cantilever.Q", Q) for Q in (100.0, 10_000.0))
    table.time(calm, lambda: run(dull), DISTANCES, U)
    table.time("figure 3 at Q = 10,000, each distance", lambda: run(sharp), DISTANCES, calm, 2.0)
    _paper(table, case)
    if quick:
        return
    transient = case.replace("solver.method", "transient")
    table.time("figure 3, transient, each of 201 distances", lambda: run(transient), DISTANCES, U, repeats=1)
    moduli = np.geomspace(0.1e9, 10e9, 64)
    viscous = case.replace("forces", [*case.forces, {"model": "kelvin_voigt", "viscosity": 10.0}])
    for label, each, limit in (("", case, 1.5), (", with Kelvin–Voigt", viscous, 2.0)):
        table.time(
            f"64 curves for moduli from 0.1 to 10 GPa by df.sweep on one core{label}, each distance",
            partial(sweep, each, {"sample.youngs_modulus": moduli}, workers=1), DISTANCES * len(moduli), U, limit, repeats=3,
        )  # fmt: skip
    table.time("a settled point by df.run, table 1", lambda: run(example("table-1-am")), 1, U)
    grid: dict[str, Any] = {"amplitude": {"stop": "10 nm", "points": 32}, "phase": {"points": 32}}
    table.time("basins, each start", lambda: basins(case, zc="9 nm", **grid), 32 * 32, U, repeats=1)


def _paper(table: Table, case: Case) -> None:
    """Add what a distance costs with SciPy's LSODA over a right-hand side in Python, and the curve as a share of it."""
    periods = math.ceil(DECAYS * case.problem.modes[0].Q / math.pi)
    name = f"{PAPER}: {periods} periods of LSODA over Python"
    python = next(row for row in table.rows if row.name == LSODA_PYTHON)
    table.rows.append(Row(name, python.seconds * periods, python.spread))
    own = next(row for row in table.rows if row.name == CURVE)
    ratio = own.seconds / (python.seconds * periods)
    table.rows.append(Row(f"{CURVE}, of the paper's", own.seconds, own.spread, ratio, name, 1.0 / 5000.0))


LAWS: tuple[tuple[str, tuple[dict[str, Any], ...], float | None], ...] = (
    ("Hertz", ({"model": "hertz"},), 0.05),
    ("van der Waals", ({"model": "van_der_waals", "hamaker": 2e-20},), None),
    ("DMT", ({"model": "dmt", "hamaker": 2e-20},), None),
    ("hydration", ({"model": "hydration"},), None),
    ("electrostatic", ({"model": "electrostatic"},), None),
    ("DMT + Kelvin–Voigt", ({"model": "dmt", "hamaker": 2e-20}, {"model": "kelvin_voigt", "viscosity": 10.0}), 0.15),
)


def laws_in_lanes(table: Table) -> None:
    """Time a period of RK4 in lanes for each law: divisions, roots and exponentials make the difference."""
    for label, forces, limit in LAWS:
        case = example("table-1-am").replace("forces", list(forces))
        lot = Lot.of([case.problem] * LANES)
        block = Block(lot, partial(_same, case.problem), case.solver, 1, POINTS, lambda: None)
        nothing = np.empty((LANES, 0))
        zc = np.full(LANES, case.experiment.zc)  # type: ignore[union-attr]
        work = partial(block.advance, np.arange(LANES), States(lot.free(), nothing, nothing), zc, PERIODS)
        table.time(f"in lanes, {LANES} cases on one core, {label}", work, PERIODS * LANES, U, limit)


def _same(problem: Problem, _: int, zc: float) -> tuple[Problem, float]:
    """Return the only problem of a block, at a distance (m)."""
    return problem, zc
