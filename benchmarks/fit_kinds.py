"""Synthetic measured curves of several kinds, with the truth that each was made of, for the benchmarks of fits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files

import numpy as np
import xarray as xr

import dforce as df

E, H, ETA, Q = "sample.youngs_modulus", "forces.dmt.hamaker", "forces.kelvin_voigt.viscosity", "cantilever.Q"
FREE = [E, H, ETA]
TRUTH = {E: 2e9, H: 6e-20, ETA: 20.0, "zc_offset": 0.35e-9, "A0": 30e-9, "phase_offset": 1.2, Q: 180.0}
SIGMA_A, SIGMA_PHI, SIGMA_Q = 0.06e-9, 0.3, 3.6
FINE = 1024  # samples per period of a truth: four times a fit's
# the stiff kind
STIFF_RANGES = {E: (2e9, 5e9), H: (2e-20, 4e-20), ETA: (10.0, 50.0)}  # by the logarithm
STIFF_START = {E: 1e9, H: 4e-20, ETA: 20.0}  # of every fit, for any truth
STIFF_A0, STIFF_SIGMA_A, STIFF_SIGMA_PHI = 25e-9, 0.1e-9, 0.5
FAR, NEAR, STEPS = 28e-9, 9e-9, 381  # m: distances of the truth, in steps of 50 pm
ATTRACTIVE, REPULSIVE = 30, 45  # points


@dataclass(frozen=True)
class Set:
    """A measured curve, the values that it was made of, the case to start a fit from, and the priors of that fit."""

    data: xr.Dataset
    truth: dict[str, float]
    start: df.Case
    priors: dict[str, tuple[float, float]]


def case_of(truth: dict[str, float], points: int | None = None) -> df.Case:
    """Return the case of a stiff sample in air with some values."""
    return df.Case(
        cantilever={"f0": 70e3, "k": 2.7, "Q": truth.get(Q, 180.0)}, drive={"A0": truth["A0"]}, tip={"radius": 8e-9},
        sample={"youngs_modulus": truth[E], "poisson_ratio": 0.3},
        forces=[df.forces.DMT(hamaker=truth[H]), df.forces.KelvinVoigt(viscosity=truth[ETA])],
        solver={} if points is None else {"points_per_period": points},
    )  # fmt: skip


def shipped() -> xr.Dataset:
    """Return the shipped curve of a stiff sample."""
    rows = _rows()
    return _dataset(rows[:, 0] * 1e-9, rows[:, 1] * 1e-9, rows[:, 2], rows[:, 3], (SIGMA_A, SIGMA_PHI))


def _rows() -> np.ndarray:
    text = (files("dforce.library") / "measured" / "stiff.csv").read_text(encoding="utf-8")
    return np.array([list(map(float, line.split(","))) for line in text.splitlines() if not line.startswith("#")])


def _dataset(
    height: np.ndarray, amplitude: np.ndarray, phase: np.ndarray, branch: np.ndarray, sigma: tuple[float, float]
) -> xr.Dataset:
    columns = {"height": height, "amplitude": amplitude, "phase": phase, "branch": branch}
    return xr.Dataset(
        {name: ("point", values) for name, values in columns.items()},
        attrs={"amplitude_error": sigma[0], "phase_error": sigma[1]},
    )


def _exact(truth: dict[str, float], height: np.ndarray, branch: np.ndarray, nearest: df.experiments.InitialMotion
           ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return amplitude and phase as they would be measured without noise; no branch may end before its last point."""
    amplitude, phase = np.empty(len(height)), np.empty(len(height))
    for kind, order in ((1, -1), (-1, 1)):
        mine = np.flatnonzero(branch == kind)
        mine = mine[np.argsort(order * height[mine])]
        way, start = ("approach", "free") if kind > 0 else ("retract", nearest)
        curve = df.approach(case_of(truth, FINE), zc=height[mine] + truth["zc_offset"], direction=way, start=start)
        assert "jump_zc" not in curve, "the truth must not jump"
        amplitude[mine], phase[mine] = curve["amplitude"].values[:, 0], curve["phase"].values[:, 0]
    return amplitude, phase + truth["phase_offset"]


def _noise(rng: np.random.Generator, count: int, drift: bool) -> np.ndarray:
    """Return noise of unit variance, white, or with drift: half of it is 1/f noise."""
    white = rng.normal(0.0, 1.0, count)
    if not drift:
        return white
    slow = np.zeros(count // 2 + 1, complex)
    slow[1:] = rng.normal(size=(count // 2, 2)) @ [1.0, 1j] / np.sqrt(np.arange(1, count // 2 + 1))
    pink = np.fft.irfft(slow, count)
    return np.sqrt(0.5) * (white + pink / pink.std())


def shipped_sets(drift: bool = False) -> Callable[[int], Set]:
    """Return a function that makes sets at the heights of the shipped curve: fresh noise, and a fresh prior of Q."""
    rows = _rows()
    height, branch = rows[:, 0] * 1e-9, rows[:, 3]
    first = np.flatnonzero(branch == -1)[np.argmin(height[branch == -1])]
    nearest = df.experiments.InitialMotion(amplitude=rows[first, 1] * 1e-9, phase=np.radians(rows[first, 2]))
    exact, start = _exact(TRUTH, height, branch, nearest), case_of(TRUTH)

    def made(number: int) -> Set:
        rng = np.random.default_rng([20251104, number])
        amplitude = exact[0] + SIGMA_A * _noise(rng, len(rows), drift)
        phase = exact[1] + SIGMA_PHI * _noise(rng, len(rows), drift)
        prior = TRUTH[Q] + rng.normal(0.0, SIGMA_Q)
        data = _dataset(height, amplitude, phase, branch, (SIGMA_A, SIGMA_PHI))
        return Set(data, TRUTH, start, {Q: (prior, SIGMA_Q)})

    return made


def stiff_sets(drift: bool = False) -> Callable[[int], Set]:
    """Return a function that makes sets of few points and much noise, each of another sample."""
    sigma = STIFF_SIGMA_A, STIFF_SIGMA_PHI
    nuisance = {"zc_offset": 0.0, "A0": STIFF_A0, "phase_offset": 0.0}
    start = case_of(STIFF_START | nuisance)

    def made(number: int) -> Set:
        rng = np.random.default_rng([20251127, number])
        drawn = {name: float(np.exp(rng.uniform(*np.log(ends)))) for name, ends in STIFF_RANGES.items()}
        offset, turn, (late, early) = rng.uniform(-0.5e-9, 0.5e-9), rng.uniform(-2.0, 2.0), rng.uniform(0.02, 1.0, 2)
        truth = drawn | {"zc_offset": float(offset), "A0": STIFF_A0, "phase_offset": float(turn)}
        loop = df.approach(case_of(truth, FINE), zc=np.linspace(FAR, NEAR, STEPS), direction="both")
        ends = loop["jump_zc"].values.min(), loop["jump_zc"].values.max()  # of the attractive and the repulsive branch
        # the last point before each jump is up to a step away from it
        steps = (FAR - ends[0]) / ATTRACTIVE, (ends[1] - NEAR) / REPULSIVE
        distances = np.concatenate([
            np.linspace(FAR, ends[0] + late * steps[0], ATTRACTIVE),
            np.linspace(NEAR, ends[1] - early * steps[1], REPULSIVE),
        ])  # fmt: skip
        branch = np.repeat([1, -1], [ATTRACTIVE, REPULSIVE])
        last = loop.sel(direction="retract").isel(zc=-1)
        nearest = df.experiments.InitialMotion(
            amplitude=float(last["amplitude"][0]), phase=np.radians(float(last["phase"][0]))
        )
        amplitude, lag = _exact(truth, distances - offset, branch, nearest)
        amplitude = amplitude + sigma[0] * _noise(rng, len(branch), drift)
        lag = lag + sigma[1] * _noise(rng, len(branch), drift)
        return Set(_dataset(distances - offset, amplitude, lag, branch, sigma), truth, start, {})

    return made


KINDS = {"shipped": shipped_sets, "stiff": stiff_sets}
