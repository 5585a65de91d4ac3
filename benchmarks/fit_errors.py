"""Whether the errors of fits hold: many synthetic curves with fresh noise, fitted from one start.

For each parameter: how often the truth lies within `error_low` and `error_high` (68 %), within `interval_low` and
`interval_high` (95 %), and within 1.96 times the `error` of the covariance; standard deviation and mean of (value - truth) /
error, of positive parameters by the logarithm; the same for the fits without lost points. The case is that of the shipped
curve `stiff.csv`; the curves are computed with four times the samples of the fit, and Q has a prior, drawn anew for each.

Run: ``python benchmarks/fit_errors.py --sets 200 --out fit_errors.csv``; it goes on where the file ends.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from importlib.resources import files
from pathlib import Path

import numpy as np
import xarray as xr

import dforce as df

E, H, ETA, Q = "sample.youngs_modulus", "forces.dmt.hamaker", "forces.kelvin_voigt.viscosity", "cantilever.Q"
TRUTH = {E: 2e9, H: 6e-20, ETA: 20.0, "zc_offset": 0.35e-9, "A0": 30e-9, "phase_offset": 1.2, Q: 180.0}
SIGMA_A, SIGMA_PHI, SIGMA_Q = 0.06e-9, 0.3, 3.6


def case(points: int | None = None) -> df.Case:
    """Return the case of the shipped curve of a stiff sample."""
    return df.Case(
        cantilever={"f0": 70e3, "k": 2.7, "Q": TRUTH[Q]}, drive={"A0": TRUTH["A0"]}, tip={"radius": 8e-9},
        sample={"youngs_modulus": TRUTH[E], "poisson_ratio": 0.3},
        forces=[df.forces.DMT(hamaker=TRUTH[H]), df.forces.KelvinVoigt(viscosity=TRUTH[ETA])],
        solver={} if points is None else {"points_per_period": points},
    )  # fmt: skip


def shipped() -> xr.Dataset:
    """Return the shipped curve."""
    rows = _rows()
    return _dataset(rows[:, 0] * 1e-9, rows[:, 1] * 1e-9, rows[:, 2], rows[:, 3])


def _rows() -> np.ndarray:
    text = (files("dforce.library") / "measured" / "stiff.csv").read_text(encoding="utf-8")
    return np.array([list(map(float, line.split(","))) for line in text.splitlines() if not line.startswith("#")])


def _dataset(height: np.ndarray, amplitude: np.ndarray, phase: np.ndarray, branch: np.ndarray) -> xr.Dataset:
    columns = {"height": height, "amplitude": amplitude, "phase": phase, "branch": branch}
    return xr.Dataset(
        {name: ("point", values) for name, values in columns.items()},
        attrs={"amplitude_error": SIGMA_A, "phase_error": SIGMA_PHI},
    )


def truth() -> xr.Dataset:
    """Return the curve without noise at the heights of the shipped one."""
    rows = _rows()
    height, branch = rows[:, 0] * 1e-9, rows[:, 3]
    amplitude, phase = np.empty(len(rows)), np.empty(len(rows))
    for kind, order in ((1, -1), (-1, 1)):
        mine = np.flatnonzero(branch == kind)
        mine = mine[np.argsort(order * height[mine])]
        nearest = df.experiments.InitialMotion(amplitude=rows[mine[0], 1] * 1e-9, phase=np.radians(rows[mine[0], 2]))
        curve = df.approach(case(1024), zc=height[mine] + TRUTH["zc_offset"], start="free" if kind > 0 else nearest)
        assert "jump_zc" not in curve, "the truth must not jump"
        amplitude[mine], phase[mine] = curve["amplitude"].values[:, 0], curve["phase"].values[:, 0]
    return _dataset(height, amplitude, phase + TRUTH["phase_offset"], branch)


def noisy(exact: xr.Dataset, rng: np.random.Generator) -> xr.Dataset:
    """Return the curve with noise."""
    out = exact.copy(deep=True)
    out["amplitude"] = exact["amplitude"] + rng.normal(0.0, SIGMA_A, exact.sizes["point"])
    out["phase"] = exact["phase"] + rng.normal(0.0, SIGMA_PHI, exact.sizes["point"])
    return out


def main() -> None:
    """Fit and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--margin", type=int, default=2, help="points beside a jump that are left out")
    parser.add_argument("--out", type=Path, default=Path("fit_errors.csv"))
    asked = parser.parse_args()
    exact, names = truth(), list(TRUTH)
    done = sum(1 for _ in asked.out.open()) if asked.out.exists() else 0
    with asked.out.open("a", newline="") as file:
        writer = csv.writer(file)
        for number in range(done, asked.sets):
            rng = np.random.default_rng([20251104, number])
            curve = noisy(exact, rng)
            prior = TRUTH[Q] + rng.normal(0.0, SIGMA_Q)
            begun = time.process_time()
            fit = df.fit(case(), curve, free=[E, H, ETA], priors={Q: (prior, SIGMA_Q)}, margin=asked.margin)
            used = time.process_time() - begun
            held = [number for name in names for number in _held(name, fit.sel(parameter=name))]
            writer.writerow([*held, fit.attrs["chi2"], fit.attrs["lost_points"], used])
            file.flush()
            if number % 10 == 9:
                print(number + 1, f"{used:.2f} s", file=sys.stderr, flush=True)
    rows = np.array([list(map(float, row)) for row in csv.reader(asked.out.open())])
    for words, some in (("all", rows), ("without lost points", rows[rows[:, -2] == 0])):
        print(f"{words}: {len(some)} sets, chi2 {some[:, -3].mean():.1f} +- {some[:, -3].std():.1f}, "
              f"{np.median(some[:, -1]):.2f} s CPU")  # fmt: skip
        table = some[:, : 3 * len(names)].reshape(len(some), len(names), 3)
        for name, (pull, one, most) in zip(names, table.transpose(1, 2, 0), strict=True):
            print(f"  {name:32s} 68 %: {one.mean():.3f}  95 %: {most.mean():.3f}  "
                  f"1.96 errors: {(abs(pull) < 1.96).mean():.3f}  std {pull.std():.3f}  mean {pull.mean():+.3f}")  # fmt: skip
        print(f"  together 95 %: {table[..., 2].mean():.4f}  1.96 errors: {(abs(table[..., 0]) < 1.96).mean():.4f}")


def _held(name: str, one: xr.Dataset) -> tuple[float, int, int]:
    """Return how far a value is from the truth in errors, and whether the truth lies in the intervals of 68 % and of 95 %."""
    value, error, truth = float(one["value"]), float(one["error"]), TRUTH[name]
    pull = np.log(value / truth) / (error / value) if name in (E, H, ETA) else (value - truth) / error
    within = value - float(one["error_low"]) < truth < value + float(one["error_high"])
    return float(pull), int(within), int(float(one["interval_low"]) < truth < float(one["interval_high"]))


if __name__ == "__main__":
    main()
