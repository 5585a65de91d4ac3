"""Whether a change of the solvers changes a number: frozen results, fresh cases against SciPy, and times of curves.

    python benchmarks/judge.py --freeze FILE.npz             write the results of today
    python benchmarks/judge.py --compare FILE.npz [--exact]  compute them again: equal to the tolerance, or to the last digit
    python benchmarks/judge.py --fresh SEED [--cases 300]    random cases against DOP853 over the plain laws alone
    python benchmarks/judge.py --times [CASE ...]            CPU time of curves, in u = one RK4 period by hand

Each exits with 1 on any miss. A frozen file belongs to one machine where `--exact` is asked for.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import math
import os
import statistics
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import handwritten
import numpy as np
import xarray as xr
from witness import Lost, Witness

import dforce as df
from dforce.checks.validation.draws import draw
from dforce.core.errors import DForceError
from dforce.core.files import write_whole
from dforce.observables.averaging import common_period
from dforce.results.status import Status

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
import fitted_curves

PROMISE = 1e-4  # of each quantity's scale, the default accuracy
RANDOM = 60  # cases of the frozen file
SEED = 28
FACTOR, NOTHING = 3.0, 3e-8  # an estimate is right within this factor; errors below the second are none
MOST_UNFLAGGED, LEAST_RIGHT = 1 / 300, 0.9
LENGTHS = (
    "mean_deflection",
    "min_deflection",
    "max_deflection",
    "half_peak_to_peak",
    "min_distance",
    "harmonic_amplitude",
)
FORCES = ("peak_force", "min_force", "mean_force")
ENERGIES = ("virial", "dissipated_energy", "total_virial", "total_dissipated_energy")
KEPT = ("amplitude", "phase", *LENGTHS, *FORCES, *ENERGIES, "contact_fraction", "peak_velocity")
JUMPS = ("jump_zc", "jump_frequency")
Scales = dict[str, Any]


def scales(case: df.Case, found: Any) -> Scales:
    """Return the size that an error of each quantity is measured by (SI; phase in degrees), beside `found`."""
    problem = case.problem
    free = np.array([tone.A0 for tone in problem.tones])
    modes = [next((tone.A0 for tone in problem.tones if tone.mode == n), free[0]) for n in range(len(problem.modes))]
    energy = np.array([m.k * A0**2 * min(1.0, 1.0 / m.Q) for m, A0 in zip(problem.modes, modes, strict=True)])
    force = np.maximum(np.abs(found["peak_force"]), np.abs(found["min_force"]))
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.degrees(free / found["amplitude"])
    sizes: Scales = dict.fromkeys(LENGTHS, free[0]) | dict.fromkeys(FORCES, force)
    return sizes | {
        "amplitude": free, "phase": turned, "virial": energy, "dissipated_energy": energy, "total_virial": energy[0],
        "total_dissipated_energy": energy[0], "contact_fraction": 1.0,
        "peak_velocity": 2.0 * np.pi * problem.tones[0].frequency * free[0],
    }  # fmt: skip


def deviation(case: df.Case, found: Any, exact: Any) -> dict[str, float]:
    """Return the largest difference of each quantity, as a share of its scale."""
    sizes, out = scales(case, exact), {}
    for name in KEPT:
        if name not in found or name not in exact:
            continue
        change = np.abs(np.asarray(found[name]) - np.asarray(exact[name]))
        if name == "phase":
            change = np.minimum(change, 360.0 - change)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(change > 0.0, change / _beside(sizes[name], change), change)
        out[name] = float(np.nanmax(share, initial=0.0))
    return out


def _beside(size: Any, change: Any) -> Any:
    """Return sizes along the same places: those of points stand in front, those of tones and modes behind."""
    size = np.asarray(size)
    return (
        size.reshape(size.shape + (1,) * (change.ndim - size.ndim)) if size.shape == change.shape[: size.ndim] else size
    )


# frozen results


def results() -> Iterator[tuple[str, df.Case | None, dict[str, Any]]]:
    """Give the name, case and numbers of everything that is frozen."""
    for name in df.examples():
        case = df.example(name)
        yield name, case, numbers(df.run(case))
    for number in range(RANDOM):
        case = draw(SEED, number).case
        yield f"random {number}", case, numbers(at_one_distance(case))
    for kind in ("air", "liquid"):
        found = df.fit(
            fitted_curves.case_of(kind), fitted_curves.data_of(kind), free=[fitted_curves.E, fitted_curves.H]
        )
        yield f"fit {kind}", None, {name: found[name].values for name in ("value", "error", "chi2") if name in found}


def numbers(result: xr.Dataset) -> dict[str, Any]:
    """Return the arrays of a result that are frozen, axes of points first."""
    names = [name for name in (*KEPT, *JUMPS, "status", "error_estimate", "stable", "reached") if name in result]
    return {name: result[name].values for name in names}


def at_one_distance(case: df.Case) -> xr.Dataset:
    """Return the settled motion at the one distance of a dwell, with the state that it can be continued from."""
    return df.approach(case, zc=[case.experiment.zc])


def freeze(path: Path) -> int:
    """Write the results of today."""
    arrays = {f"{name}/{key}": value for name, _, found in results() for key, value in found.items()}
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    write_whole(path, content.getvalue())
    print(f"{len(arrays)} arrays in {path}")
    return 0


def compare(path: Path, exact: bool) -> int:
    """Compute all again, and name what differs."""
    frozen, misses = np.load(path), []
    for name, case, found in results():
        before = {key.rpartition("/")[2]: frozen[key] for key in frozen.files if key.rpartition("/")[0] == name}
        misses += [f"{name}: {what}" for what in differences(case, before, found, exact)]
    for miss in misses:
        print(miss)
    print(f"{len(misses)} misses against {path}")
    return int(bool(misses))


def differences(case: df.Case | None, before: dict[str, Any], found: dict[str, Any], exact: bool) -> Iterator[str]:
    """Give in words what differs from before."""
    for key in before.keys() - found.keys():
        yield f"{key} is missing"
    same = [key for key in before if key in found]
    if exact or case is None:
        for key in same:
            equal = np.array_equal(before[key], found[key], equal_nan=before[key].dtype.kind == "f")
            if not equal and not (case is None and not exact and np.allclose(before[key], found[key], rtol=1e-3)):
                yield f"{key} differs"
        return
    for key in same:
        if before[key].shape != found[key].shape:
            yield f"{key} has {found[key].shape} numbers instead of {before[key].shape}"
            return
    lost = np.count_nonzero((before["status"] == Status.OK) & (found["status"] != Status.OK))
    if lost:
        yield f"{lost} points that were ok are not"
    for key, off in deviation(case, found, before).items():
        if off > 2.0 * PROMISE:
            yield f"{key} is {off:.1e} of its scale off"
    for key in JUMPS:
        if key in before and np.nanmax(np.abs(before[key] / found[key] - 1.0), initial=0.0) > PROMISE:
            yield f"{key} is at {found[key]}, before at {before[key]}"


# fresh cases


@dataclass(frozen=True)
class Outcome:
    """What became of a fresh case: a word, the estimated and the true error, and the quantity that is farthest off."""

    number: int
    text: str
    word: str
    estimate: float = math.nan
    error: float = math.nan
    quantity: str = ""

    @property
    def is_right(self) -> bool:
        """Whether the estimate is right within the factor, or both are nothing."""
        least, most = sorted((max(self.estimate, NOTHING), max(self.error, NOTHING)))
        return most <= FACTOR * least


def varied(seed: int, number: int) -> df.Case:
    """Return a random case: half off resonance, a fourth over a shaken base, Q from 1.2 to 50,000."""
    case, rng = draw(seed, number).case, np.random.default_rng([seed, number, 2])
    mode = case.problem.modes[0]
    if number % 5 == 0 and len(case.problem.modes) == 1:
        Q = math.exp(rng.uniform(math.log(1.2), math.log(5e4)))
        case = case.replace("cantilever.modes.1.Q", Q)
    elif number % 2 and len(case.problem.modes) == 1:
        case = case.replace(
            "drive.tones.1.frequency", mode.f0 * (1.0 + rng.uniform(-1.0, 1.0) * min(2.0 / mode.Q, 0.05))
        )
    if number % 4 == 3 and len(case.problem.modes) == 1:
        case = case.replace("drive.excitation", "base")
    return case


def witnessed(case: df.Case, point: xr.Dataset) -> dict[str, Any]:
    """Return what SciPy measures on its own orbit near a point of a result."""
    parts = dict(zip((str(name) for name in point.component.values), point.motion.values.tolist(), strict=True))
    x = np.array(
        [value for start in ("z_", "v_", "memory_") for name, value in parts.items() if name.startswith(start)]
    )
    latches = [value for name, value in parts.items() if name.startswith("branch")]
    tones = case.problem.tones
    periods = common_period([tone.frequency for tone in tones])
    if periods is None:
        raise Lost("the tones never repeat together")
    seconds = periods * float(point.repeat_periods) / tones[0].frequency
    witness = Witness(case.problem, float(point.zc))
    return witness.measure(witness.orbit(x, latches, seconds), latches, seconds)


def outcome(seed: int, number: int) -> Outcome:
    """Return what became of a fresh case."""
    case = varied(seed, number)
    named = partial(Outcome, number, draw(seed, number).text)
    try:
        point = at_one_distance(case).isel(zc=0)
    except DForceError as error:
        return named(f"refused: {error}")
    status, estimate = Status(int(point.status)), float(point.error_estimate)
    if status not in (Status.OK, Status.INACCURATE):
        return named(status.meaning)
    if not math.isfinite(estimate):
        return named(
            "not a number" if not np.isfinite(point.amplitude.values).all() else f"{status.meaning}, no estimate"
        )
    try:
        exact = witnessed(case, point)
    except (Lost, np.linalg.LinAlgError):
        return named("no witness")
    off = deviation(case, {name: point[name].values for name in KEPT if name in point}, exact)
    worst = max(off, key=lambda name: off[name])
    beyond = "within the promise" if off[worst] <= PROMISE else "beyond it"
    return named(f"{status.meaning}, {beyond}", estimate, off[worst], worst)


def fresh(seed: int, count: int) -> int:
    """Hold fresh cases against SciPy, and count."""
    outcomes: list[Outcome] = []
    with warnings.catch_warnings(action="ignore"), contextlib.suppress(KeyboardInterrupt):
        for number in range(count):
            outcomes.append(outcome(seed, number))
            if sys.stderr.isatty():
                print(f"\r{number + 1} of {count}", end="", file=sys.stderr)
    for word, many in Counter(one.word for one in outcomes).most_common():
        print(f"{many:5d}  {word}")
    held = [one for one in outcomes if math.isfinite(one.error)]
    unflagged = [one for one in held if one.word == "ok, beyond it"]
    right = sum(one.is_right for one in held)
    low = sum(one.estimate < one.error / FACTOR and not one.is_right for one in held)
    print(f"{len(held)} held against SciPy: estimate right within {FACTOR:g} in {right}, too low in {low}")
    for one in sorted(held, key=lambda one: -one.error)[:20]:
        print(
            f"  {one.number:4d} {one.word:28s} estimated {one.estimate:.1e}, off {one.error:.1e} in {one.quantity}: {one.text}"
        )
    return int(len(unflagged) > MOST_UNFLAGGED * count or right < LEAST_RIGHT * len(held))


# times


STIFF = {
    "cantilever": {"f0": "300 kHz", "k": "40 N/m", "Q": 400}, "drive": {"A0": "20 nm"}, "tip": {"radius": "10 nm"},
    "sample": {"youngs_modulus": "2 GPa", "poisson_ratio": 0.3},
}  # fmt: skip
WATER = {
    "cantilever": {"f0": "30 kHz", "k": "0.5 N/m", "Q": 2}, "drive": {"A0": "10 nm"}, "tip": {"radius": "10 nm"},
    "sample": {"youngs_modulus": "50 MPa", "poisson_ratio": 0.3}, "forces": [{"model": "hertz"}],
}  # fmt: skip
THERE_AND_BACK = {"start": "24 nm", "stop": "8 nm", "points": 201}


def approach(start: str, stop: str, points: int = 201, direction: str = "approach") -> dict[str, Any]:
    """Return an approach as an experiment."""
    return {"kind": "approach", "direction": direction, "zc": {"start": start, "stop": stop, "points": points}}


def moduli(low: str, high: str) -> dict[str, Any]:
    """Return 64 moduli to sweep over."""
    return {"sample.youngs_modulus": {"start": low, "stop": high, "points": 64, "spacing": "log"}}


def timed_cases() -> dict[str, tuple[bool, Callable[[], xr.Dataset]]]:
    """Return by name whether a case is meant to touch, and its work."""
    air = df.example("figure-3-air").replace("experiment", approach("12 nm", "2 nm"))
    dmt_stiff = df.Case(
        cantilever={"f0": "350 kHz", "k": "40 N/m", "Q": 400}, drive={"A0": "30 nm"}, tip={"radius": "20 nm"},
        sample={"youngs_modulus": "1.2 GPa", "poisson_ratio": 0.3}, forces=[{"model": "dmt", "hamaker": "7.1e-20 J"}],
        experiment=approach("36 nm", "15 nm", direction="both"),
    )  # fmt: skip
    drag = {"model": "kelvin_voigt", "viscosity": "20 Pa s"}
    both = approach("24 nm", "8 nm", direction="both")
    h = df.Case(**STIFF, forces=[{"model": "dmt", "hamaker": "6e-20 J"}, drag], experiment=both)
    i = df.Case(**STIFF, forces=[{"model": "jkr", "surface_energy": "0.02 J/m^2"}], experiment=both)
    f = df.Case(**WATER, experiment=approach("11 nm", "2 nm"))
    f_drag = f.replace("forces", [{"model": "hertz"}, {"model": "kelvin_voigt", "viscosity": "5 Pa s"}])
    memory = {"model": "sls", "elements": 48, "instant_modulus": "50 MPa", "relaxed_modulus": "10 MPa"}
    bimodal = df.example("table-1-bimodal").replace("experiment", approach("11 nm", "4 nm"))

    def swept(case: df.Case, low: str, high: str) -> Callable[[], xr.Dataset]:
        return partial(df.sweep, case, moduli(low, high), workers=1)

    return {
        "a": (False, partial(df.run, air)), "c": (True, partial(df.run, dmt_stiff)),
        "g": (True, partial(df.run, df.example("hysteresis"))), "h": (True, partial(df.run, h)),
        "i": (True, partial(df.run, i)), "f": (True, partial(df.run, f)), "f with drag": (True, partial(df.run, f_drag)),
        "64 of h": (True, swept(h, "0.1 GPa", "10 GPa")), "64 of f": (True, swept(f, "5 MPa", "500 MPa")),
        "64 of f with drag": (True, swept(f_drag, "5 MPa", "500 MPa")),
        "f, 10,000 points": (True, partial(df.run, f.replace("experiment.zc.points", 10_000))),
        "bimodal": (True, partial(df.run, bimodal)),
        "f, 48 elements": (True, partial(df.run, f.replace("forces", [memory]))),
    }  # fmt: skip


def one_u() -> float:
    """Return the CPU time (s) of one RK4 period by hand, 128 samples over a Hertz contact."""
    cosine, sine = handwritten.tables(128)
    periods, best = 400, math.inf
    for _ in range(20):
        begin = time.process_time()
        handwritten.hertz(0.767, 1.0, 0.01, cosine, sine, 128, periods)
        best = min(best, time.process_time() - begin)
    return best / periods


def times(names: list[str]) -> int:
    """Print the CPU time of curves, a point, in u; fail a touching case that does not touch."""
    cases, missed = timed_cases(), 0
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else os.cpu_count())
    print(f"{'case':20s} {'points':>7s} {'touching':>8s} {'ok':>6s} {'u a point':>9s} {'u':>8s}")
    for name in names or cases:
        touching, work = cases[name]
        result, taken = work(), []
        u = one_u()
        while len(taken) < 3 or (sum(taken) < 1.0 and len(taken) < 20):
            begin = time.process_time()
            work()
            taken.append(time.process_time() - begin)
        points = result.status.size
        share = float((result.max_indentation.values > 0.0).mean())
        ok = int((result.status.values == Status.OK).sum())
        wrong = touching and share < 0.5
        missed += wrong
        print(
            f"{name:20s} {points:7d} {share:8.0%} {ok:6d} {statistics.median(taken) / points / u:9.1f} {1e6 * u:5.2f} us"
            + ("  does not touch" if wrong else "")
        )
    return int(bool(missed))


def main() -> int:
    """Do what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--freeze", type=Path, metavar="FILE")
    parser.add_argument("--compare", type=Path, metavar="FILE")
    parser.add_argument("--exact", action="store_true", help="with --compare: equal to the last digit")
    parser.add_argument("--fresh", type=int, metavar="SEED")
    parser.add_argument("--cases", type=int, default=300)
    parser.add_argument("--times", nargs="*", metavar="CASE")
    asked = parser.parse_args()
    missed = 0
    if asked.freeze:
        missed |= freeze(asked.freeze)
    if asked.compare:
        missed |= compare(asked.compare, asked.exact)
    if asked.fresh is not None:
        missed |= fresh(asked.fresh, asked.cases)
    if asked.times is not None:
        missed |= times(asked.times)
    return missed


if __name__ == "__main__":
    sys.exit(main())
