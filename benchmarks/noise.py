"""Check noise that is computed against noise that is simulated, and rates against Kramers': minutes, so not a test.

Run it as ``python benchmarks/noise.py``. It prints the linear noise of amplitude and phase at ten points of figure 3's curve
beside the noise of many lanes with its interval: cold, where both have to agree, and at room temperature, where thermal motion
is a third of the distance to the surface and the linear noise a scale; and the rate at which a still lever snaps in.
"""

from __future__ import annotations

import math
import sys
import time

import numpy as np

import dforce as df
from dforce.solvers.integrator import with_amplitudes
from dforce.solvers.langevin import Langevin

BANDWIDTH = 1e3  # Hz
LANES, PERIODS = 150, 2400
# The noise beyond the linear grows by the root of the temperature, by the force's kink: at 3 K 1.5 % is left at 5 nm.
COLD = "0.03 K"
SIGMAS = 4.0  # of the simulation's own spread: one of twenty numbers is farther off by chance in 1 of 800 runs


def along_figure_3(temperature: str) -> int:
    """Print both noises at ten points; return how many are apart."""
    case = df.example("figure-3-air").replace("medium.temperature", temperature)
    print(f"at {temperature}")
    curve = df.approach(case, zc=np.linspace(11e-9, 2e-9, 10), direction="approach")
    computed = df.noise(curve, BANDWIDTH)
    apart = 0
    print("zc (nm)   amplitude noise (pm)            phase noise (deg)               lanes' spread")
    for place in range(curve.sizes["zc"]):
        point = curve.isel(zc=place)
        lanes = df.noisy_motion(point, seeds=LANES, periods=PERIODS, bandwidth=BANDWIDTH)
        row, errors = [f"{float(point.zc) * 1e9:7.2f}"], []
        for name, scale in (("amplitude", 1e12), ("phase", 1.0)):
            runs = lanes[name].values[..., 0]
            # about the mean of all, so that each lane's square is unbiased; lanes are independent
            squares = ((runs - runs.mean()) ** 2).mean(axis=1)
            found = math.sqrt(squares.mean())
            error = 0.5 * float(squares.std(ddof=1)) / math.sqrt(LANES) / found
            linear = float(computed[f"{name}_noise"].values[place, 0])
            off = (linear - found) / error
            errors.append(off)
            row.append(f"{linear * scale:9.4g} / {found * scale:9.4g} +- {error * scale:7.2g}")
        apart += any(abs(off) > SIGMAS for off in errors)
        print("  ".join(row), "  ".join(f"{off:+.1f}" for off in errors), flush=True)
    return apart


def snap_in() -> None:
    """Print the rate at which thermal motion takes a still lever to the surface, beside Kramers'."""
    case = df.Case(
        cantilever=df.Cantilever(f0="20 kHz", k="0.3 N/m", Q=1), drive=df.Drive(A0="0.1 pm"), tip=df.Tip(radius="20 nm"),
        forces=[df.forces.VanDerWaals(hamaker="4e-20 J")], solver={"integrator": "langevin", "points_per_period": 128},
    )  # fmt: skip
    for zc, lanes, most in ((1.55e-9, 400, 400), (1.60e-9, 400, 1500), (1.65e-9, 1000, 4000)):
        kramers = df.snap_in_rate(case, zc)
        integrator = Langevin(case.problem, case.solver, 1)
        integrator.place(zc)
        start = with_amplitudes(integrator, integrator.problem.free)
        running = integrator.lanes([start] * lanes, range(lanes))
        events, at_risk, wait = 0, 0, 10
        for period in range(most):
            running, _ = integrator.run(running, 1)
            gone = running.lowest < float(kramers.barrier_distance) - 0.15e-9
            if period >= wait:
                events, at_risk = events + int(gone.sum()), at_risk + len(gone)
            running = running.part(np.flatnonzero(~gone))
            if not len(running.y):
                break
        rate = events / at_risk * case.problem.tones[0].frequency
        print(
            f"zc {zc * 1e9:.2f} nm: simulated {rate:.4g} +- {rate / math.sqrt(max(events, 1)):.2g} 1/s from {events}, "
            f"Kramers {float(kramers.switching_rate):.4g} 1/s"
        )


def main() -> int:
    """Print both; return 1 where a point of the curve is apart."""
    start = time.perf_counter()
    snap_in()
    apart = along_figure_3(COLD)
    along_figure_3("298.15 K")
    print(
        f"cold {apart} of 10 points apart by more than {SIGMAS:g} standard deviations, {time.perf_counter() - start:.0f} s"
    )
    return int(apart > 0)


if __name__ == "__main__":
    sys.exit(main())
