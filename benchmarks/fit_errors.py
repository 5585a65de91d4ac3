"""Whether the errors of fits hold: many synthetic curves with fresh noise, fitted from one start.

For each parameter: how often the truth lies within `error_low` and `error_high` (68 %), within `interval_low` and
`interval_high` (95 %), and within 1.96 times the `error` of the covariance; standard deviation and mean of (value - truth) /
error, of positive parameters by the logarithm; the same for the fits without lost points. `--kind shipped`: curves at the
heights of the shipped `stiff.csv`, where Q has a prior, drawn anew for each. `--kind stiff`: 75 points with a noise of 100 pm
and 0.5 degrees on both branches of samples of 2 to 5 GPa, each with values of its own. All curves are computed with four
times the samples of the fit; `fit_kinds.py` holds the seeds.

Run: ``python benchmarks/fit_errors.py --kind stiff --sets 200 --out fit_errors.csv``; it goes on where the file ends.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from pathlib import Path

import numpy as np
import xarray as xr
from fit_kinds import FREE, KINDS, Set

import dforce as df


def main() -> None:
    """Fit and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kind", choices=list(KINDS), default="shipped")
    parser.add_argument("--noise", choices=("white", "drift"), default="white", help="drift: half of it is 1/f noise")
    parser.add_argument("--first", type=int, default=0, help="number of the first set")
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--margin", type=int, help="points beside a jump that are left out")
    parser.add_argument("--out", type=Path, default=Path("fit_errors.csv"))
    asked = parser.parse_args()
    made, names = KINDS[asked.kind](asked.noise == "drift"), [""]
    done = sum(1 for _ in asked.out.open()) - 1 if asked.out.exists() else 0
    with asked.out.open("a", newline="") as file:
        writer = csv.writer(file)
        for number in range(asked.first + done, asked.first + asked.sets):
            one = made(number)
            begun = time.process_time()
            fit = df.fit(one.start, one.data, free=FREE, priors=one.priors, margin=asked.margin)
            used = time.process_time() - begun
            names = fit["parameter"].values.tolist()
            if not file.tell():
                writer.writerow(names)
            others = int((fit["minimum_chi2"] < fit.attrs["chi2"] + 3.84).sum()) - 1
            held = [value for name in names for value in _held(one, fit.sel(parameter=name))]
            writer.writerow([*held, others, fit.attrs["chi2"], fit.attrs["lost_points"], used])
            file.flush()
            if number % 10 == 9:
                print(number + 1, f"{used:.2f} s", file=sys.stderr, flush=True)
    with asked.out.open() as file:
        names, *lines = csv.reader(file)
    rows = np.array([list(map(float, line)) for line in lines])
    print(f"{asked.kind}, sets {asked.first} to {asked.first + len(rows) - 1}")
    for words, some in (("all", rows), ("without lost points", rows[rows[:, -2] == 0])):
        print(f"{words}: {len(some)} sets, chi2 {some[:, -3].mean():.1f} +- {some[:, -3].std():.1f}, "
              f"{int((some[:, -4] > 0).sum())} with other minima, {np.median(some[:, -1]):.2f} s CPU")  # fmt: skip
        table = some[:, : 3 * len(names)].reshape(len(some), len(names), 3)
        for name, (pull, one, most) in zip(names, table.transpose(1, 2, 0), strict=True):
            seen = np.isfinite(pull)
            pull, one, most = pull[seen], one[seen], most[seen]
            print(f"  {name:32s} 68 %: {one.mean():.3f}  95 %: {most.mean():.3f} ({int(most.sum())} of {seen.sum()} seen)  "
                  f"1.96 errors: {(abs(pull) < 1.96).mean():.3f}  std {pull.std():.3f}  mean {pull.mean():+.3f}")  # fmt: skip
        seen = np.isfinite(table[..., 0])
        print(
            f"  together 95 %: {table[seen][:, 2].mean():.4f}  1.96 errors: {(abs(table[seen][:, 0]) < 1.96).mean():.4f}"
        )


def _held(made: Set, one: xr.Dataset) -> tuple[float, int, int]:
    """Return how far a value is from the truth in errors, and whether the truth lies in the intervals of 68 % and of 95 %."""
    name = str(one["parameter"].values)
    value, error, truth = float(one["value"]), float(one["error"]), made.truth[name]
    pull = np.log(value / truth) / (error / value) if name in FREE else (value - truth) / error
    within = value - float(one["error_low"]) < truth < value + float(one["error_high"])
    return float(pull), int(within), int(float(one["interval_low"]) < truth < float(one["interval_high"]))


if __name__ == "__main__":
    main()
