"""The cost of locked states: curves in FM-AFM beside the same curves in tapping mode, points of two tones from their neighbors.

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
from dforce.solvers.torus import FoundTorus

ZC, STEP = 4e-9, 0.02e-9  # m: a point of AM-FM, and how far from it the neighbor lies
MISMATCH = 1e-8  # of a torus that is found
AIR, WATER = (100.0, 200.0), (2.0, 5.0)  # quality factors
HERTZ, DMT = [{"model": "hertz"}], [{"model": "dmt", "hamaker": "2e-20 J"}]
VISCOUS = [*HERTZ, {"model": "kelvin_voigt", "viscosity": "100 Pa s"}]
# name: quality factors, forces, radius, modulus; amplitude of the first tone, its free amplitude (None: FM-FM), amplitude of
# the second tone; phases of the first tone
POINTS = {
    "AM-FM, Hertz": (AIR, HERTZ, "20 nm", "1 GPa", "4 nm", "7.351847 nm", "0.1 nm", 512),
    "FM-FM, Hertz": (AIR, HERTZ, "2 nm", "1 GPa", "4.2 nm", None, "0.1 nm", 512),
    "AM-FM, DMT": (AIR, DMT, "2 nm", "1 GPa", "4.2 nm", "4.24636 nm", "0.1 nm", 4096),
    "AM-FM, viscous": (AIR, VISCOUS, "2 nm", "50 MPa", "4.6 nm", "5.31434 nm", "0.1 nm", 4096),
    "AM-FM, water": (WATER, HERTZ, "5 nm", "50 MPa", "4.5 nm", "4.500937 nm", "0.2 nm", 4096),
}


def from_neighbor(
    Q: tuple[float, float], forces: list, radius: str, E: str, A1: str, A01: str | None, A2: str, phases: int
) -> Callable[[], FoundTorus]:
    """Return a function that finds a point of two tones from its neighbor."""
    modes = [{"f0": "48.9 kHz", "k": "0.9 N/m", "Q": Q[0]}, {"f0": "282 kHz", "k": "28 N/m", "Q": Q[1]}]
    second = {"A0": A2, "operation": "fm", "signal": "mode"}

    def tori(first: dict[str, str]) -> TwoTones:
        case = df.Case(
            cantilever={"modes": modes},
            drive={"tones": [first, second]},
            tip={"radius": radius},
            sample={"youngs_modulus": E, "poisson_ratio": 0.3},
            forces=forces,
        )
        return TwoTones(case.problem, case.solver, lambda: None)

    # a lock of the first amplitude passes the folds of amplitude modulation
    held = tori({"A0": A1, "operation": "pm" if A01 else "fm", "signal": "mode"})
    held.at(ZC + STEP)
    asked, torus = tori({"A0": A01}) if A01 else held, held.torus
    while torus.grid[0] < phases:
        torus = torus.finer(False)
    units = held.length / asked.length
    torus = torus._replace(z=torus.z * units, drive=torus.drive * units)
    near = asked.balance(ZC + STEP).find(torus, MISMATCH).torus
    return lambda: asked.balance(ZC).find(near, MISMATCH)


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
    for name, point in POINTS.items():
        find = from_neighbor(*point)
        found = find()
        assert found.mismatch <= MISMATCH
        shift = found.torus.omega[1] / found.torus.omega[0]
        phases = " x ".join(map(str, found.torus.grid))
        print(f"{name}, {phases} phases, f2/f1 = {shift:.6f}, from its neighbor: {1e3 * least(find, repeat):.1f} ms")


if __name__ == "__main__":
    main()
