"""The cost and the accuracy of a period of the engine, for motions that tap: `python benchmarks/engine.py`.

Each motion starts at the same swing. Its end is held against SciPy's DOP853 over the plain laws (`witness.py`), at several
tolerances of a step, and its CPU time is printed in u = one RK4 period by hand (`handwritten.py`): of the motion alone, with
its derivatives, and measured with ten harmonics.
"""

from __future__ import annotations

import math
import time

import numpy as np
from curve_times import one_u
from witness import Witness

import dforce as df
from dforce import kernel
from dforce.engine.marching import Marcher, Start
from dforce.observables import measure

LANES, SWING = 64, 0.62  # motions marched at once; start, in free amplitudes, 0.4 rad behind the upper turn
STIFF = {
    "cantilever": {"f0": "300 kHz", "k": "40 N/m", "Q": 400}, "drive": {"A0": "20 nm"}, "tip": {"radius": "10 nm"},
    "sample": {"youngs_modulus": "2 GPa", "poisson_ratio": 0.3},
}  # fmt: skip
SOFT = STIFF | {
    "cantilever": {"f0": "30 kHz", "k": "0.5 N/m", "Q": 2},
    "sample": {"youngs_modulus": "50 MPa", "poisson_ratio": 0.3},
}
DRAG = {"model": "kelvin_voigt", "viscosity": "20 Pa s"}
MOTIONS = {
    "Hertz, water": (SOFT, [{"model": "hertz"}]),
    "Hertz and drag, water": (SOFT, [{"model": "hertz"}, DRAG | {"viscosity": "5 Pa s"}]),
    "DMT": (STIFF, [{"model": "dmt", "hamaker": "6e-20 J"}]),
    "DMT and drag": (STIFF, [{"model": "dmt", "hamaker": "6e-20 J"}, DRAG]),
    "JKR": (STIFF, [{"model": "jkr", "surface_energy": "0.02 J/m^2"}]),
    "48 elements, water": (SOFT, [{"model": "sls", "instant_modulus": "50 MPa", "relaxed_modulus": "10 MPa"}]),
}


def main() -> None:
    """Print a table."""
    u = one_u()
    print(f"u = {1e6 * u:.2f} us")
    heads = f"{'contact':>8s} {'u a period':>10s} {'with columns':>12s} {'measured':>9s}"
    print(f"{'motion':24s} {'tolerance':>9s} {'error':>8s} {heads}")
    for name, (settings, forces) in MOTIONS.items():
        problem = df.Case(**settings, forces=forces).problem
        witness = Witness(problem, 0.6 * problem.tones[0].A0)
        x = SWING * np.array([math.cos(0.4), math.sin(0.4)])
        memory, latches = witness.memory, sum(force.switch is not None for force in problem.forces)
        there = np.concatenate([x * witness.scale[:2], np.zeros(memory)])
        exact = witness.march(there, [0.0] * latches, 1.0 / problem.tones[0].frequency)[:2] / witness.scale[:2]
        kinks = np.unique(np.append(kernel.kink_distances(problem), problem.a0))
        start = Start(
            np.array([kernel.parameters(problem, witness.zc)] * LANES), np.array([kernel.tone_table(problem)] * LANES),
            np.tile(kinks, (LANES, 1)), np.tile(x, (LANES, 1)), np.zeros((LANES, memory)), np.zeros((LANES, latches)),
        )  # fmt: skip
        marcher, unit = Marcher.of(problem), np.full(LANES, problem.tones[0].A0)
        touched = marcher.march(start, 1, (1e-9, 1.0, 1e-6), harmonics=1).rows[0, 0, measure.IN_CONTACT]
        for tolerance in (1e-6, 1e-8, 1e-10):
            limits, times = (tolerance, 0.1, 1e-4), []
            error = float(np.abs(marcher.march(start, 1, limits).path[0, -1] - exact).max())
            for columns, harmonics in ((None, None), (unit if memory == 0 else None, None), (None, 10)):
                taken = []
                for _ in range(20):
                    begin = time.process_time()
                    marcher.march(start, 1, limits, unit=columns, harmonics=harmonics)
                    taken.append(time.process_time() - begin)
                times.append(min(taken) / LANES / u)
            second = f"{times[1]:12.1f}" if memory == 0 else f"{'-':>12s}"
            print(f"{name:24s} {tolerance:9.0e} {error:8.1e} {touched:8.1%} {times[0]:10.1f} {second} {times[2]:9.1f}")


if __name__ == "__main__":
    main()
