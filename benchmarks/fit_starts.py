"""From how many random starts a fit reaches the right minimum: E, H and viscosity within a factor 5, heights within 1 nm.

Run: ``python benchmarks/fit_starts.py --starts 30``; the shipped curve of a stiff sample has its lowest chi2 at 201.55.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from fit_kinds import ETA, FREE, TRUTH, E, H, case_of, shipped

import dforce as df

RIGHT = 202.0  # chi2


def main() -> None:
    """Fit and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    rng, right = np.random.default_rng(asked.seed), 0
    for number in range(asked.starts):
        factors, shift = np.exp(rng.uniform(-np.log(5.0), np.log(5.0), 3)), rng.uniform(-1e-9, 1e-9)
        start = {E: 2e9 * factors[0], H: 6e-20 * factors[1], ETA: 20.0 * factors[2], "zc_offset": shift}
        begun = time.process_time()
        chi2 = df.fit(case_of(TRUTH), shipped(), free=FREE, start=start).attrs["chi2"]
        right += chi2 < RIGHT
        print(number + 1, f"chi2 {chi2:.3f}", f"{time.process_time() - begun:.2f} s CPU", flush=True)
    print(f"{right} of {asked.starts} starts reach the right minimum")


if __name__ == "__main__":
    main()
