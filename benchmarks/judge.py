"""Whether a change of the solvers changes a number: frozen results, fresh cases against SciPy, and times of curves.

    python benchmarks/judge.py --freeze FILE.npz             write the results of today
    python benchmarks/judge.py --compare FILE.npz [--exact]  compute them again: equal to the tolerance, or to the last digit
    python benchmarks/judge.py --fresh SEED [--cases 300]    random cases against DOP853 over the plain laws alone
    python benchmarks/judge.py --times [CASE ...]            CPU time of curves, see curve_times.py

Each exits with 1 on any miss, and with 130 behind Ctrl-C. A frozen file belongs to one machine where `--exact` is asked for.
"""

from __future__ import annotations

import argparse
import io
import math
import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from curve_times import times
from ending import end_with
from witness import Lost, Witness

import dforce as df
from dforce.checks.validation.draws import draw
from dforce.core.errors import DForceError
from dforce.core.files import write_whole
from dforce.core.stopping import until_stopped
from dforce.observables.averaging import common_period
from dforce.results.status import Status, whole

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
    """Return sizes along the same places: points in front, tones and modes behind."""
    size = np.asarray(size)
    return (
        size.reshape(size.shape + (1,) * (change.ndim - size.ndim)) if size.shape == change.shape[: size.ndim] else size
    )


# frozen results


def results() -> Iterator[tuple[str, df.Case | None, dict[str, Any]]]:
    """Give the name, case and numbers of everything that is frozen."""
    for name in df.examples():
        case = df.example(name)
        yield name, case, numbers(whole(df.run(case)))
    for number in range(RANDOM):
        case = draw(SEED, number).case
        yield f"random {number}", case, numbers(at_one_distance(case))
    for kind in ("air", "liquid"):
        model, data = fitted_curves.case_of(kind), fitted_curves.data_of(kind)
        found = whole(df.fit(model, data, free=[fitted_curves.E, fitted_curves.H]))
        yield f"fit {kind}", None, {name: found[name].values for name in ("value", "error", "chi2") if name in found}


def numbers(result: xr.Dataset) -> dict[str, Any]:
    """Return the arrays of a result that are frozen, axes of points first."""
    names = [name for name in (*KEPT, *JUMPS, "status", "error_estimate", "stable", "reached") if name in result]
    return {name: result[name].values for name in names}


def at_one_distance(case: df.Case) -> xr.Dataset:
    """Return the settled motion at the one distance of a dwell, with the state that it can be continued from."""
    return whole(df.approach(case, zc=[case.experiment.zc]))


def freeze(path: Path) -> int:
    """Write the results of today."""
    arrays = {f"{name}/{key}": value for name, _, found in results() for key, value in found.items()}
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    write_whole(path, content.getvalue())
    print(f"{len(arrays)} arrays in {path}")
    return 0


def compare(path: Path, exact: bool) -> int:
    """Compute all again, and name the differences."""
    frozen, misses = np.load(path), []
    for name, case, found in results():
        before = {key.rpartition("/")[2]: frozen[key] for key in frozen.files if key.rpartition("/")[0] == name}
        misses += [f"{name}: {one}" for one in differences(case, before, found, exact)]
    for miss in misses:
        print(miss)
    print(f"{len(misses)} misses against {path}")
    return int(bool(misses))


def differences(case: df.Case | None, before: dict[str, Any], found: dict[str, Any], exact: bool) -> Iterator[str]:
    """Give the differences from before in words."""
    for key in before.keys() - found.keys():
        yield f"{key} is missing"
    same = [key for key in before if key in found]
    if exact or case is None:
        for key in same:
            equal = np.array_equal(before[key], found[key], equal_nan=before[key].dtype.kind == "f")
            if not equal and not (
                case is None and not exact and np.allclose(before[key], found[key], rtol=1e-3, equal_nan=True)
            ):
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
    """The verdict on a fresh case: a word, the estimated and the true error, and the quantity that is farthest off."""

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
    """Return SciPy's measurements on its own orbit near a point of a result."""
    parts = dict(zip((str(name) for name in point.component.values), point.motion.values.tolist(), strict=True))
    x = np.array(
        [value for start in ("z_", "v_", "memory_") for name, value in parts.items() if name.startswith(start)]
    )
    latches = [value for name, value in parts.items() if name.startswith("branch")]
    tones = case.problem.tones
    periods = common_period([tone.frequency for tone in tones])
    if periods is None:
        raise Lost("the tones never repeat together")
    if not np.isfinite(point.repeat_periods):
        raise Lost("the motion has settled in time, and no orbit is known near it")
    seconds = periods * float(point.repeat_periods) / tones[0].frequency
    witness = Witness(case.problem, float(point.zc))
    return witness.measure(witness.orbit(x, latches, seconds), latches, seconds)


def outcome(seed: int, number: int) -> Outcome:
    """Return the outcome of a fresh case."""
    case = varied(seed, number)
    named = partial(Outcome, number, draw(seed, number).text)
    try:
        point = at_one_distance(case).isel(zc=0)
    except DForceError as error:
        return named(f"refused: {error}")
    status, estimate = Status(int(point.status)), float(point.get("error_estimate", math.nan))
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
    with warnings.catch_warnings(action="ignore"), until_stopped() as stop:
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
    if stop.came:
        raise KeyboardInterrupt
    return int(len(unflagged) > MOST_UNFLAGGED * count or right < LEAST_RIGHT * len(held))


def main() -> int:
    """Run the command."""
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
    end_with(main)
