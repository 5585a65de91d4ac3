"""What dForce costs on this machine, as ratios to loops written by hand and to the way of earlier simulators."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from dforce.case import Case, example
from dforce.checks.benchmark import end_to_end, many_users
from dforce.checks.benchmark.table import POINTS, Row, Table, U
from dforce.core import child
from dforce.core.errors import ParameterError, checked
from dforce.kernel import cache
from dforce.solvers.integrator import INTEGRATORS, Integrator, Motion, free_amplitudes, with_amplitudes

CASE = "table-1-am"
FEW = 8  # periods of what takes milliseconds each


@checked
def benchmark(quick: bool = False, progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Time the parts of dForce and return a table with the machine it was made on.

    Parameters
    ----------
    quick
        Few repeats and few forces, and nothing that starts processes: a second or two once the kernels are on disk, to see
        that it works.
    progress
        Called with the name of what is timed next.

    Returns
    -------
    dict
        `rows`: a list of :class:`Row` as dictionaries; `window`: a list of :class:`people.Measure` as dictionaries, none
        where `quick`; `machine`; `note`: how to read it.
    """
    repeats, budget, clock = (3, 0.02, WORKED) if quick else (7, 0.2, time.perf_counter)
    table = Table(repeats, budget, progress or (lambda name: None), clock)
    _periods(table, quick)
    _several_forces(table, 2 if quick else 5)
    _then_and_now(table, (POINTS,) if quick else (128, 256, 512))
    end_to_end.curves(table, quick)
    if not quick:
        end_to_end.laws_in_lanes(table)
        _processes(table)
    window = [] if quick else many_users.measures(*many_users.MANY, table.progress)
    return {
        "rows": [asdict(row) for row in table.rows], "window": [asdict(measure) for measure in window],
        "machine": machine(), "note": f"{ROUGH} {NOTE}" if quick else NOTE,
    }  # fmt: skip


# what others do on the machine counts little in a processor's time; Windows counts it in steps of 16 ms
WORKED = time.perf_counter if sys.platform == "win32" else time.process_time
NOTE = (
    "u is one period of the loop written by hand for a Hertz contact. In the paper LSODA was 2.8 to 11 times faster than "
    "RK4, both over right-hand sides in Python, where each call costs microseconds and LSODA makes fewer; once the "
    "right-hand side is compiled a call costs nanoseconds, LSODA's own bookkeeping dominates, and RK4 wins."
)
ROUGH = (
    "These figures are rough: each is the best of few, in processor time where the system counts it finely, and a ratio may be "
    "off by a third. Left out are new processes, the transient, many curves at once, basins, laws in lanes, and the window."
)


def machine() -> dict[str, str]:
    """Return what the figures depend on."""
    versions = {name: importlib.metadata.version(name) for name in ("dforce", "numpy", "numba", "scipy")}
    return {
        "platform": platform.platform(),
        "processor": platform.processor() or platform.machine(),
        "cores": str(os.cpu_count()),
        "python": platform.python_version(),
        **versions,
    }


LSODA_PYTHON = "LSODA over Python, Hertz"
COMPOSED = "composed RK4, DMT + Kelvin–Voigt"
THIRD: tuple[dict[str, Any], ...] = (
    {"model": "hydration", "energy": 1e-3, "decay": 3e-10}, {"model": "electrostatic"}, {"model": "magnetic_dipole"},
)  # fmt: skip


def by_hand() -> ModuleType:
    """Return the loops written by hand; compiled once, as kernels are."""
    return cache.load(Path(__file__).with_name("handwritten.py").read_text(encoding="utf-8"))


def _ready(case: Case, zc: float, **settings: Any) -> tuple[Integrator, Motion]:
    """Return an integrator at a distance and the free motion, its kernel compiled."""
    solver = case.solver.replace(method="transient", points_per_period=POINTS, **settings)
    if solver.integrator not in INTEGRATORS:
        raise ParameterError(f"solver.integrator = {solver.integrator} has no steady motion that could be timed")
    integrator = INTEGRATORS[solver.integrator](case.problem, solver, 10)
    integrator.place(zc)
    return integrator, with_amplitudes(integrator, free_amplitudes(integrator))


def _sticky() -> Case:
    """Return the case with DMT and Kelvin–Voigt."""
    return example(CASE).replace(
        "forces", [{"model": "dmt", "hamaker": 2e-20}, {"model": "kelvin_voigt", "viscosity": 10.0}]
    )


def _periods(table: Table, quick: bool) -> None:
    """Time one period of motion."""
    hand = by_hand()
    case, periods = example(CASE), 400
    problem = case.problem
    mode, tone = problem.modes[0], problem.tones[0]
    zc, length, g = case.experiment.zc, tone.A0, 1.0 / mode.Q  # type: ignore[union-attr]
    stiffness = problem.forces[0].numbers()[0]
    scaled = stiffness * length**1.5 / (mode.k * length)
    cosine, sine = hand.tables(POINTS)
    surface = (zc - problem.a0) / length
    table.time(U, lambda: hand.hertz(surface, scaled, g, cosine, sine, POINTS, periods), periods)
    surfaces = np.full(hand.LANES, surface)
    x, v = np.zeros(hand.LANES), np.zeros(hand.LANES)
    table.time(
        "by hand, 16 cases side by side, each",
        lambda: hand.hertz_lanes(surfaces, scaled, g, cosine, POINTS, periods, x, v), periods * hand.LANES, U,
    )  # fmt: skip
    sticky = _sticky()
    force = sticky.problem.forces[0]
    elastic, attraction, adhesion, a0 = force.numbers()
    unit = mode.k * length
    law = (
        a0 / length, elastic * length**1.5 / unit, attraction / (length**2 * unit), adhesion / unit,
        10.0 * (2e-9 * length) ** 0.5 * 2.0 * np.pi * tone.frequency * length / unit,
    )  # fmt: skip
    table.time(
        "RK4 by hand, DMT + Kelvin–Voigt",
        lambda: hand.dmt_kelvin_voigt(zc / length, law, g, cosine, POINTS, periods), periods, U,
    )  # fmt: skip
    cases = {
        "composed RK4, Hertz": (case, None),
        COMPOSED: (sticky, 2.0),
    } | {
        f"{COMPOSED} + {third['model']}": (sticky.replace("forces", [*_as_given(sticky), third]), 1.3)
        for third in (() if quick else THIRD)
    }  # fmt: skip
    for name, (chosen, limit) in cases.items():
        integrator, motion = _ready(chosen, zc)
        table.time(name, partial(integrator.lock_in, motion, periods), periods, U, limit)
    integrator, motion = _ready(case, zc, integrator="adaptive")
    table.time("composed adaptive, Hertz", lambda: integrator.lock_in(motion, 100), 100, U)


def _several_forces(table: Table, count: int) -> None:
    """Time several forces at once against the sum of a run with each."""
    forces = [
        {"model": "dmt", "hamaker": 2e-20}, {"model": "kelvin_voigt", "viscosity": 10.0}, {"model": "electrostatic"},
        {"model": "hydration"}, {"model": "capillary"},
    ][:count]  # fmt: skip
    case, periods = example(CASE).replace("cantilever.k", 5.0), 400
    zc = case.experiment.zc  # type: ignore[union-attr]
    runs = [_ready(case.replace("forces", [force]), zc) for force in forces]
    each = f"{count} runs, a force each"
    table.time(each, lambda: [integrator.lock_in(motion, periods) for integrator, motion in runs], periods, U)
    integrator, motion = _ready(case.replace("forces", forces), zc)
    table.time(f"one run, {count} forces", lambda: integrator.lock_in(motion, periods), periods, each, 1.5)


def _as_given(case: Case) -> list[dict[str, Any]]:
    return [{"model": force.name, **force.model_dump(exclude_unset=True)} for force in case.forces]


def _then_and_now(table: Table, points: tuple[int, ...]) -> None:
    """Time LSODA against RK4, over Python and compiled: the paper's table 2."""
    from dforce.checks.benchmark import scipy_baseline

    for label, name in (("Hertz", CASE), ("Hertz, bimodal", "table-1-bimodal")):
        case = example(name)
        problem, zc = case.problem, case.experiment.zc  # type: ignore[union-attr]
        rates, size = scipy_baseline.python_rates(problem, zc), 2 * len(problem.modes)
        for m in points:
            suffix = label if m == POINTS and label == "Hertz" else f"{label}, m = {m}"
            old = f"LSODA over Python, {suffix}"
            table.time(old, partial(scipy_baseline.lsoda, rates, size, m, FEW), FEW, U)
            table.time(f"RK4 over Python, {suffix}", partial(scipy_baseline.rk4, rates, size, m, FEW), FEW, old)
            new = f"LSODA compiled, {suffix}"
            for integrator, title, to in (("lsoda", new, ""), ("rk4", f"RK4 compiled, {suffix}", new)):
                solver = case.solver.replace(method="transient", integrator=integrator, points_per_period=m)
                machine_ = INTEGRATORS[integrator](problem, solver, 10)
                machine_.points = m
                machine_.block = np.zeros((m + 1, machine_.block.shape[1]))
                machine_.place(zc)
                motion = with_amplitudes(machine_, free_amplitudes(machine_))
                table.time(title, partial(machine_.lock_in, motion, FEW), FEW, to)
    composed = next(row for row in table.rows if row.name == COMPOSED)
    python = next(row for row in table.rows if row.name == LSODA_PYTHON)
    # the least that is asked for: 60 times less than LSODA over Python
    table.rows.append(
        Row(f"{COMPOSED}, of LSODA over Python", composed.seconds, composed.spread, composed.seconds / python.seconds,
            LSODA_PYTHON, 1.0 / 60.0)
    )  # fmt: skip


IN_WINDOW = "the same in the window and in `dforce run`"
# what makes early answers possible, of which the first run of all leaves the making to the background
PREPARE = """
from dforce import example
from dforce.kernel.tip import Tip
from dforce.solvers.integrator import CALLED, load_kernels
problem = example('{case}').problem
Tip(load_kernels(problem)[0], problem, CALLED).prepare(('advance_lanes', 'advance', 'measure_force'))
"""
# nothing is compiled in the background: it would go on beside what is timed next
EARLY = """
from dforce.core.first_answer import early_answers
from dforce.kernel import behind
behind.begin = lambda *what: True
with early_answers():
    {run}
"""
FIRST = """
from dforce.core.first_answer import early_answers
from dforce.kernel import behind
from dforce.solvers import beside
behind.begin, beside.LATER = lambda *what: False, ()
with early_answers():
    {run}
"""


def _processes(table: Table) -> None:
    """Time new processes: import, help, and the first result with and without kernels on disk."""
    run = "import dforce; dforce.run(dforce.example('table-1-am'))"

    def process(code: str, folder: str | None = None) -> None:
        environment = child.environment() | ({"DFORCE_CACHE_DIR": folder} if folder else {})
        subprocess.run(child.command("-c", code), check=True, capture_output=True, env=environment)

    table.time("python starts", lambda: process("pass"), repeats=3)
    table.time("import dforce", lambda: process("import dforce"), limit=0.5, repeats=3)
    command = "import sys; from dforce.cli import main; sys.argv = ['dforce', '--help']; main()"
    table.time("dforce --help", lambda: process(command), limit=0.8, repeats=3)
    table.time("a dwell in a new process, kernels on disk", lambda: process(run), limit=3.0, repeats=3)

    def cold(code: str) -> None:
        with tempfile.TemporaryDirectory() as folder:
            process(code, folder)

    table.time("a dwell in a new process, nothing on disk", partial(cold, run), repeats=1)
    table.time(IN_WINDOW, partial(cold, FIRST.format(run=run)), limit=10.0, repeats=1)
    with tempfile.TemporaryDirectory() as folder:
        process(run, folder)
        process(PREPARE.format(case=CASE), folder)

        def other(code: str, forces: Iterator[str]) -> None:
            replaced = f"').replace('forces', [{{'model': 'hertz'}}, {{'model': '{next(forces)}'}}])"
            process(code.replace("')", replaced, 1), folder)

        for name, code, forces, limit in (
            ("a dwell in a new process, forces never used before", run, ("hydration", "electrostatic"), None),
            (IN_WINDOW, EARLY.format(run=run), ("solvation", "magnetic_dipole"), 3.0),
        ):
            table.time(name, partial(other, code, iter(forces)), limit=limit, repeats=1)
