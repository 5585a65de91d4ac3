"""The cost of a base that is shaken: 64 motions side by side, against the same under forces.

    python benchmarks/base_drive.py

prints the CPU time of a motion over a period of the first tone, the best of 300 in turns, for one and two modes and tones, far
from the surface and in contact; times exclude compilation. On a busy machine with two cores:

    far
        1 mode, 1 tone:    force 0.76 us; lagging force 0.77 us, ratio 1.03; base 0.78 us, ratio 1.03
        1 mode, 2 tones:   force 0.77 us; lagging force 0.79 us, ratio 1.02; base 0.78 us, ratio 1.01
        2 modes, 1 tone:   force 1.03 us; lagging force 1.03 us, ratio 1.00; base 1.03 us, ratio 1.01
        2 modes, 2 tones:  force 0.98 us; lagging force 1.14 us, ratio 1.16; base 1.14 us, ratio 1.16
    in contact
        1 mode, 1 tone:    force 0.99 us; lagging force 0.99 us, ratio 1.00; base 0.99 us, ratio 1.00
        1 mode, 2 tones:   force 1.50 us; lagging force 1.51 us, ratio 1.01; base 1.20 us, ratio 0.80
        2 modes, 1 tone:   force 1.23 us; lagging force 1.27 us, ratio 1.03; base 1.29 us, ratio 1.05
        2 modes, 2 tones:  force 1.63 us; lagging force 1.79 us, ratio 1.10; base 2.21 us, ratio 1.36

A base drives each mode with a cosine and a sine of each tone, a force with the cosine alone: with two modes and two tones
there are eight rows of drive in the place of four. Far from the surface, where nothing else differs, that is the ratio. In
contact the motions differ, and with them how many of their steps are cut at the surface or taken in parts, which costs more
than the drive does. A force that lags by next to nothing tells both apart: it has the motion of the force, and the rows of
the base.
"""

import time
from collections.abc import Callable

import numpy as np

import dforce as df
from dforce.experiments.base import initial_motion
from dforce.solvers.block import Block
from dforce.solvers.problem_batch import ProblemBatch
from dforce.solvers.states import States

LANES, POINTS, PERIODS, RUNS = 64, 256, 20, 300
PLACES = {"far": 30e-9, "in contact": 9e-9}  # m
KINDS = {"force": {}, "lagging force": {"lag": "1e-9 deg"}, "base": {}}


def case(modes: int, tones: int, kind: str) -> df.Case:
    """Return a case of so many modes and tones."""
    levers = [{"f0": 75e3, "k": 2.8, "Q": 200}, {"f0": 470e3, "k": 110, "Q": 400}]
    drives = [{"A0": "10 nm", "frequency": 75e3}, {"A0": "1 nm", "frequency": 450e3, "mode": modes}]
    return df.Case(
        cantilever={"modes": levers[:modes]},
        drive={
            "tones": [one | KINDS[kind] for one in drives[:tones]],
            "excitation": "base" if kind == "base" else "force",
        },
        tip={"radius": "10 nm"},
        sample={"youngs_modulus": 1e9, "poisson_ratio": 0.3},
        forces=[df.forces.DMT(hamaker=1e-19)],
    )


def marching(asked: df.Case, place: float) -> Callable[[], float]:
    """Return a function that marches motions at a distance (m), and returns the CPU time (s) of a motion over a period."""
    problem, lanes = asked.problem, np.arange(LANES)
    block = Block(
        ProblemBatch.of([problem] * LANES), lambda _, zc: (problem, zc), asked.solver, 1, POINTS, lambda: None
    )
    states = States.of(*[initial_motion(block.integrator(0, place), "free")] * LANES)
    zc = np.full(LANES, place)
    block.advance(lanes, states, zc, 1)  # compiles

    def march() -> float:
        start = time.process_time()
        block.advance(lanes, states, zc, PERIODS)
        return (time.process_time() - start) / (LANES * PERIODS * block.common)

    return march


for where, place in PLACES.items():
    print(where)
    for modes in (1, 2):
        for tones in (1, 2):
            ways = [marching(case(modes, tones, kind), place) for kind in KINDS]
            # in turns, so that other work of the machine meets all of them
            force, lagging, base = np.min([[way() for way in ways] for _ in range(RUNS)], axis=0)
            row = f"{modes} mode{'s' * (modes > 1)}, {tones} tone{'s' * (tones > 1)}:"
            print(
                f"    {row:18s} force {1e6 * force:.2f} us; lagging force {1e6 * lagging:.2f} us, ratio "
                f"{lagging / force:.2f}; base {1e6 * base:.2f} us, ratio {base / force:.2f}"
            )
