"""What locked states cost: curves in FM-AFM beside the same curves in tapping mode, and a point of AM-FM from its neighbor.

    python benchmarks/locked.py [--repeat 7]

Times are CPU times, the least of several runs, after one that is not counted. Beside each curve stands the share of its points
that touch the sample.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import dforce as df
from dforce.procedures.two_tones import TwoTones

STEP = 0.02e-9  # m between a point of AM-FM and its neighbor
MISMATCH = 1e-8  # of a torus that is found
HERTZ = {
    "cantilever": {"modes": [{"f0": "48.9 kHz", "k": "0.9 N/m", "Q": 100}, {"f0": "282 kHz", "k": "28 N/m", "Q": 200}]},
    "sample": {"youngs_modulus": "1 GPa", "poisson_ratio": 0.3},
    "forces": [{"model": "hertz"}],
}
AM_FM = [{"A0": "7.351847 nm"}, {"A0": "0.1 nm", "operation": "fm"}]
FM_FM = [{"A0": "4.2 nm", "operation": "fm"}, {"A0": "0.1 nm", "operation": "fm"}]


def least(run: Callable[[], object], repeat: int) -> float:
    """Return the least CPU time (s) of several runs after the first."""
    times = []
    for _ in range(repeat + 1):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times[1:])


def curves() -> dict[str, df.Case]:
    """Return curves in tapping mode by name."""
    air = df.example("figure-3-air")
    zc = {"start": "14 nm", "stop": "9.4 nm", "points": 201}
    return {
        "figure-3-air, 14 to 9.4 nm": air.replace(experiment={"kind": "approach", "zc": zc}),
        "hysteresis": df.example("hysteresis"),
    }


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeat", type=int, default=7)
    repeat = parser.parse_args().repeat
    for name, case in curves().items():
        locked = case.replace("drive.operation", "fm")
        touching = float((df.run(locked)["max_indentation"] > 0.0).mean())
        am, fm = (least(lambda one=one: df.run(one), repeat) for one in (case, locked))
        print(
            f"{name}: {100.0 * touching:.0f} % touch in FM; AM {1e3 * am:.1f} ms, FM {1e3 * fm:.1f} ms, ratio {fm / am:.2f}"
        )
    for name, tones, radius in (("AM-FM", AM_FM, "20 nm"), ("FM-FM", FM_FM, "2 nm")):
        case = df.Case(**HERTZ, tip={"radius": radius}, drive={"tones": tones})
        tori = TwoTones(case.problem, case.solver, lambda: None)
        tori.at(4e-9 + STEP)
        balance, near = tori.balance(4e-9), tori.torus
        took = least(lambda b=balance, n=near: b.find(n, MISMATCH), repeat)
        phases = " x ".join(map(str, near.grid))
        print(f"{name}, Hertz, {phases} phases, from its neighbor: {1e3 * took:.1f} ms")


if __name__ == "__main__":
    main()
