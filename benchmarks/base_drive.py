"""What a base that is shaken costs: 64 motions side by side, against the same under forces.

    python benchmarks/base_drive.py

prints the CPU time of a motion over a period of the first tone, the best of seven, for one and two modes and tones; times
exclude compilation. On a busy machine with two cores:

    1 mode, 1 tone:    force 1.46 us, base 1.46 us, ratio 1.00
    1 mode, 2 tones:   force 1.97 us, base 1.91 us, ratio 0.97
    2 modes, 1 tone:   force 1.97 us, base 1.95 us, ratio 0.99
    2 modes, 2 tones:  force 2.42 us, base 3.25 us, ratio 1.34

A base drives each mode with a cosine and a sine of each tone, a force with the cosine alone: the last line shows what eight
rows of drive cost more than four.
"""

import time

import numpy as np

import dforce as df
from dforce.experiments.base import initial_motion
from dforce.solvers.block import Block
from dforce.solvers.problem_batch import Lot
from dforce.solvers.states import States

LANES, POINTS, PERIODS, RUNS = 64, 256, 20, 7
ZC = 9e-9


def case(modes: int, tones: int, excitation: str) -> df.Case:
    """Return a case of so many modes and tones."""
    levers = [{"f0": 75e3, "k": 2.8, "Q": 200}, {"f0": 470e3, "k": 110, "Q": 400}]
    drives = [{"A0": "10 nm", "frequency": 75e3}, {"A0": "1 nm", "frequency": 450e3, "mode": modes}]
    return df.Case(
        cantilever={"modes": levers[:modes]},
        drive={"tones": drives[:tones], "excitation": excitation},
        tip={"radius": "10 nm"},
        sample={"youngs_modulus": 1e9, "poisson_ratio": 0.3},
        forces=[df.forces.DMT(hamaker=1e-19)],
    )


def seconds(asked: df.Case) -> float:
    """Return the CPU time (s) of a motion over a period, the best of some runs."""
    problem, lanes = asked.problem, np.arange(LANES)
    block = Block(Lot.of([problem] * LANES), lambda _, zc: (problem, zc), asked.solver, 1, POINTS, lambda: None)
    states = States.of(*[initial_motion(block.integrator(0, ZC), "free")] * LANES)
    zc, found = np.full(LANES, ZC), []
    block.advance(lanes, states, zc, 1)  # compiles
    for _ in range(RUNS):
        start = time.process_time()
        block.advance(lanes, states, zc, PERIODS)
        found.append(time.process_time() - start)
    return min(found) / (LANES * PERIODS * block.common)


for modes in (1, 2):
    for tones in (1, 2):
        force, base = (seconds(case(modes, tones, excitation)) for excitation in ("force", "base"))
        what = f"{modes} mode{'s' * (modes > 1)}, {tones} tone{'s' * (tones > 1)}:"
        print(f"{what:18s} force {1e6 * force:.2f} us, base {1e6 * base:.2f} us, ratio {base / force:.2f}")
