"""The cost of forces that are called by their address in each step: whole curves, beside steps compiled for their forces.

    python benchmarks/by_address.py [--repeat 5]

Times are CPU times, the least of several runs, after one that is not counted and may compile. Beside each curve stands the
share of its points that touch the sample.
"""

from __future__ import annotations

import argparse
import time
from unittest import mock

import numpy as np

import dforce as df
from dforce.solvers import tip_equations
from dforce.solvers.compiled import CALLED

SOFT = df.Case(
    cantilever=df.Cantilever(f0="30 kHz", k="0.5 N/m", Q=2),
    drive=df.Drive(A0="10 nm"),
    tip=df.Tip(radius="10 nm"),
    sample=df.Sample(youngs_modulus="50 MPa", poisson_ratio=0.3),
    forces=[df.forces.Hertz()],
)
STIFF = df.Case(
    cantilever=df.Cantilever(f0="350 kHz", k="40 N/m", Q=400),
    drive=df.Drive(A0="30 nm"),
    tip=df.Tip(radius="20 nm"),
    sample=df.Sample(youngs_modulus="1.2 GPa", poisson_ratio=0.3),
    forces=[df.forces.DMT(hamaker="7.1e-20 J")],
)
CURVES = {
    "figure-3-air": (df.example("figure-3-air"), "12 nm", "2 nm"),
    "Hertz in water": (SOFT, "11 nm", "2 nm"),
    "DMT, stiff": (STIFF, "36 nm", "15 nm"),
    "DMT and drag": (
        STIFF.replace(forces=[df.forces.DMT(hamaker="6e-20 J"), df.forces.KelvinVoigt(viscosity="20 Pa s")]),
        "36 nm",
        "15 nm",
    ),
}


def timed(case: df.Case, start: str, stop: str, repeat: int) -> tuple[float, float]:
    """Return the least CPU time (s) of a curve, and the share of its points that touch."""
    times = []
    for _ in range(repeat + 1):
        begun = time.process_time()
        curve = df.approach(case, zc={"start": start, "stop": stop, "points": 201})
        times.append(time.process_time() - begun)
    return min(times[1:]), float(np.mean(curve["contact_fraction"] > 0.0))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=5)
    repeat = parser.parse_args().repeat
    print(f"{'curve':16} {'touching':>8} {'own code':>9} {'by address':>10} {'ratio':>5}")
    for name, (case, start, stop) in CURVES.items():
        own, touching = timed(case, start, stop, repeat)
        with mock.patch.object(tip_equations, "SHARED", CALLED):
            other, _ = timed(case, start, stop, repeat)
        print(f"{name:16} {touching:8.0%} {own * 1e3:6.1f} ms {other * 1e3:7.1f} ms {other / own:5.1f}")


if __name__ == "__main__":
    main()
