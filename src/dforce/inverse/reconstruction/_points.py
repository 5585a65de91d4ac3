"""The force at each point of a curve, computed or measured: virial and energy of the fundamental."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case, case_of
from dforce.core.arrays import Array, Complexes
from dforce.core.errors import ParameterError
from dforce.instrument import Cantilever, Drive, ModeNumbers
from dforce.inverse.reconstruction._path import HARMONICS, Motions
from dforce.observables.misfit import GROSS
from dforce.results.status import check_computed, repeats
from dforce.validity import Evidence
from dforce.validity.laws import other_forces
from dforce.validity.sampling import step_error

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem

LEAST_POINTS = 8
HEIGHT_TOLERANCE = 3.0  # errors of the height sensor by which a walk may turn back
# smallest errors of computed curves, as a share of the free amplitude and in rad; their own virial shows larger errors
COMPUTED_AMPLITUDE, COMPUTED_PHASE = 1e-6, 1e-5
SHIFT = 1e-3  # of an error, for derivatives
SAME_LAG, SAME_SHARE = 0.5, 1e-3  # degrees, and of the amplitude: data that a lever without a case describes
LOCKED_BETWEEN = (0.1, 5.0)  # resonance frequencies


@dataclass(frozen=True)
class CurvePoints:
    """The readings at each point of a curve; one value each, in SI, angles in rad.

    Attributes
    ----------
    height, amplitude, phase
        Average distance (m), amplitude (m) and lag that the detector reads.
    shift
        Frequency shift (Hz) of a curve that holds the phase; None where the frequency is held.
    drive
        Amplitude of the driving force (N), where it was recorded; NaN where it was not.
    errors
        Standard deviation of each quantity, by its name.
    virial
        The virial (J) that a computed curve itself gives, where amplitude and phase should give the same; None of others.
    """

    height: Array
    amplitude: Array
    phase: Array
    shift: Array | None
    drive: Array
    errors: dict[str, Array]
    virial: Array | None = None

    @property
    def distance_error(self) -> float:
        """Standard deviation (m) of the distance at which the tip turns, of most points: of height and amplitude."""
        height = self.errors.get("height", np.zeros(1))
        return float(np.hypot(np.median(self.errors["amplitude"]), np.median(height)))

    def shifted(self, name: str) -> CurvePoints:
        """Return the reading with one quantity changed by a small part of its error."""
        return replace(self, **{name: getattr(self, name) + SHIFT * self.errors[name]})


@dataclass(frozen=True)
class Balance:
    r"""The force's averages: :math:`V = \langle F z \rangle` and the energy E of the tip's fundamental (J)."""

    motions: Motions
    virial: Array
    energy: Array


def balances(reading: CurvePoints, problem: Problem) -> tuple[Balance, list[Balance]]:
    """Return virial and energy of the points, and the same with each quantity off by a small part of its error."""
    return balance(reading, problem), [balance(reading.shifted(name), problem) for name in reading.errors]


def standard_deviation(changes: Iterable[Array]) -> Array:
    """Return the error of numbers that change by so much with a small part of each quantity's error."""
    return np.asarray(np.sqrt(sum((change / SHIFT) ** 2 for change in changes)))


def balance(reading: CurvePoints, problem: Problem) -> Balance:
    r"""Return virial and energy of the fundamental at each point.

    The force's own phasor is the part of the reading X that the drive alone leaves unexplained,

    .. math:: \hat F = \frac{X - X_\mathrm{free}}{\sum_n w_n G_n}, \qquad V = \tfrac12 \mathrm{Re}(\hat F X_\mathrm{tip}^*),
              \qquad E = -\pi\, \mathrm{Im}(\hat F X_\mathrm{tip}^*),

    with the detector's weights w; for one mode :math:`V = \tfrac12 k A^2 (1 - r^2) - \tfrac12 F_0 A \cos\varphi`. Without a
    record of the drive of a phase-locked curve, V is its value without loss, and E is unknown.
    """
    if reading.shift is not None:
        return _locked(reading, problem, reading.shift)
    tone = problem.tones[0]
    turn = problem.readout.turns[0] if problem.readout.turns else 0.0
    start = np.exp(-1j * tone.phase)
    seen = reading.amplitude * np.exp(-1j * (reading.phase - turn))
    one = np.array([_mode_responses(problem, np.array([tone.frequency]))[n][0] for n in range(len(problem.modes))])
    weights = np.array(problem.readout.weights[0])
    force = (seen - problem.detected_free[0] * start) / (weights @ one)
    tip = problem.free[0].sum() * start + problem.base[0] + one.sum() * force
    frequency = np.full(len(seen), tone.frequency)
    return _balance(reading.height, tip, force, frequency, problem)


def _locked(reading: CurvePoints, problem: Problem, shift: Array) -> Balance:
    """Return the balance of a curve whose phase is held; one mode, driven by a force."""
    mode = problem.modes[0]
    cotangent = np.cos(reading.phase) / np.sin(reading.phase)
    frequency = _lagging(mode, cotangent) + shift
    stiffness = np.asarray(mode.stiffness(frequency))
    amplitude = reading.amplitude / abs(problem.readout.weights[0][0])
    lossless = stiffness.imag * amplitude / np.sin(reading.phase)
    drive = np.where(np.isnan(reading.drive), lossless, reading.drive)
    tip = amplitude * np.exp(-1j * reading.phase)
    found = _balance(reading.height, tip, stiffness * tip - drive, frequency, problem)
    return Balance(found.motions, found.virial, np.where(np.isnan(reading.drive), np.nan, found.energy))


def _lagging(mode: ModeNumbers, cotangent: Array) -> Array:
    """Return the frequencies (Hz) at which a free mode lags behind its drive by angles of these cotangents.

    Raises
    ------
    ParameterError
        Where a mode with the fluid's memory does so nowhere near its resonance.
    """
    if mode.memory is None:
        return np.asarray(mode.f0 * (-cotangent / (2.0 * mode.Q) + np.sqrt(1.0 + (cotangent / (2.0 * mode.Q)) ** 2)))
    from scipy.optimize import brentq

    each, where = np.unique(cotangent, return_inverse=True)
    low, high = (share * mode.f0 for share in LOCKED_BETWEEN)

    def ahead(frequency: float, one: float) -> float:
        return float((mode.stiffness(frequency) * (1.0 + 1j * one)).real)

    for one in each:
        if not ahead(low, one) > 0.0 > ahead(high, one):
            raise ParameterError("the curve contains a phase that the lever has nowhere near its resonance")
    found = [brentq(ahead, low, high, args=(one,), xtol=1e-12 * mode.f0, rtol=1e-14) for one in each]
    return np.array(found)[where]


def _balance(height: Array, tip: Complexes, force: Complexes, frequency: Array, problem: Problem) -> Balance:
    response = np.stack([sum(_mode_responses(problem, order * frequency)) for order in range(HARMONICS + 1)], axis=1)
    mobility = sum(mode.oscillator[0] ** 2 / mode.k for mode in problem.modes) / frequency**2
    work = force * tip.conj()
    return Balance(Motions(height, np.abs(tip), frequency, response, mobility), 0.5 * work.real, -np.pi * work.imag)


def _mode_responses(problem: Problem, frequency: Array) -> list[Complexes]:
    """Return the answer of each mode to a force (m/N) at frequencies (Hz)."""
    return [np.asarray(1.0 / mode.stiffness(frequency), dtype=complex) for mode in problem.modes]


def read_points(data: xr.Dataset, case: Case | None, given: Mapping[str, float]) -> tuple[CurvePoints, Case]:
    """Return the points of a result or of a measured curve, and its case; `given` are errors (m, degrees).

    Raises
    ------
    ParameterError
        When it is neither, or has too little information.
    """
    check_computed(data)
    computed = "zc" in data.variables and "status" in data.variables
    if not computed and "height" not in data.variables:
        raise ParameterError(
            "this is not a curve over the distance: it has neither zc and status, as results of approach and branches, "
            "nor height, as a measured curve"
        )
    if data.attrs.get("kind") == "fit":
        raise ParameterError("this is a fit; pass its measured curve")
    reading, case = _computed(data, case) if computed else _measured(data, case)
    errors = reading.errors | {
        name: np.full(len(reading.height), np.deg2rad(value) if name == "phase" else value)
        for name, value in given.items()
    }
    for name in ("amplitude", "phase"):
        if name not in errors:
            raise ParameterError(f"the data have no {name}_error, needed for the error of the force; pass it")
        if not (np.isfinite(errors[name]).all() and (errors[name] > 0.0).all()):
            raise ParameterError(f"{name}_error is not above 0")
    reading = replace(reading, errors=errors)
    _check(reading, case)
    return reading, case


def _computed(data: xr.Dataset, case: Case | None) -> tuple[CurvePoints, Case]:
    """Return the points of a result that settled and repeat every period."""
    if case is not None:
        raise ParameterError("a result contains its case; pass no case")
    case = case_of(data)
    case.problem.refuse_lock("the reconstruction of a force")
    dims = set(data["amplitude"].dims) - {"tone"} if "amplitude" in data else set()
    if "zc" in data.dims and dims - {"direction"} == {"zc"}:
        walk = data.stack(place=[str(dim) for dim in ("direction", "zc") if dim in data.dims], create_index=False)
    elif dims == {"point"} and "branch" in data:
        walk = data.rename(point="place")
    else:
        raise ParameterError("this result is not a single curve over the distance; choose one with .isel or .sel")
    seen = Evidence(case, data)
    if ((off := step_error(seen)) is not None and off.found > GROSS) or (off := other_forces(seen)) is not None:
        raise ParameterError(f"this result has points of another case. {off.text}")
    walk = walk.transpose("place", ...)
    good = repeats(walk["status"].values)
    if "repeat_periods" in walk:
        good &= walk["repeat_periods"].values == 1
    size = float(abs(case.problem.detected_free[0]))
    count = int(good.sum())
    plain = len(case.problem.modes) == 1 and case.problem.shaken is None and "virial" in walk
    reading = CurvePoints(
        height=walk["zc"].values[good],
        amplitude=walk["amplitude"].values[good][:, 0],
        phase=np.deg2rad(walk["phase"].values[good][:, 0]),
        shift=walk["frequency_shift"].values[good] if "frequency_shift" in walk else None,
        drive=np.full(count, np.nan),
        errors={"amplitude": np.full(count, COMPUTED_AMPLITUDE * size), "phase": np.full(count, COMPUTED_PHASE)},
        virial=walk["virial"].values[good][:, 0] if plain else None,
    )
    return reading, case


def _measured(data: xr.Dataset, case: Case | None) -> tuple[CurvePoints, Case]:
    """Return the points of a measured curve, and the instrument from its attributes or the case."""
    locked = "frequency_shift" in data.variables
    for name in ("height", "amplitude", *(() if locked else ("phase",))):
        if name not in data.variables:
            raise ParameterError(f"the measured curve has no '{name}'")
        if data[name].dims != ("point",):
            raise ParameterError(f"'{name}' of the measured curve is not a row along the dimension 'point'")
    count = data.sizes["point"]

    def column(name: str, missing: float) -> Array:
        if name not in data.variables:
            return np.full(count, missing)
        values = np.asarray(data[name].values, dtype=float)
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise ParameterError(f"'{name}' has no finite number at point {bad[0] + 1}; remove such points")
        return values

    group = np.zeros(count, dtype=int)
    for number, name in enumerate(("direction", "branch")):
        if name in data.variables:
            group += (number + 1) * 10 * np.unique(data[name].values, return_inverse=True)[1]
    errors = {}
    for name, unit in (("amplitude", 1.0), ("phase", np.pi / 180.0), ("height", 1.0), ("frequency_shift", 1.0)):
        if f"{name}_error" in data.attrs:
            value = float(data.attrs[f"{name}_error"]) * unit
            errors["shift" if name == "frequency_shift" else name] = np.full(count, value)
    if locked:
        errors.setdefault("phase", np.full(count, 1e-12))  # held: the controller's own business
        if "shift" not in errors:
            raise ParameterError("the data have no frequency_shift_error, needed for the error of the force")
    _check_order(column("height", np.nan), group, float(data.attrs.get("height_error", 0.0)))
    reading = CurvePoints(
        column("height", np.nan),
        column("amplitude", np.nan),
        np.deg2rad(column("phase", 90.0)),
        column("frequency_shift", 0.0) if locked else None,
        column("drive_force", np.nan),
        errors,
    )
    return reading, _instrument(data, case, locked, float(reading.amplitude.max(initial=0.0)))


def _check_order(height: Array, group: Any, error: float) -> None:
    """Raise ParameterError where the heights of one walk turn back by more than the error of the sensor."""
    for number in np.unique(group):
        places = np.flatnonzero(group == number)
        step = np.diff(height[places])
        way = 1.0 if np.sum(step) >= 0.0 else -1.0
        turned = np.flatnonzero(way * step < -HEIGHT_TOLERANCE * error)
        if len(turned):
            raise ParameterError(
                f"the heights of one direction turn back at point {places[turned[0] + 1] + 1}: sort them, or mark the "
                "directions in a column 'direction'"
            )
        if error == 0.0 and np.any(step == 0.0):
            raise ParameterError(
                f"point {places[np.flatnonzero(step == 0.0)[0] + 1] + 1} has the height of the point before; average such "
                f"points"
            )


def _instrument(data: xr.Dataset, case: Case | None, locked: bool, largest: float) -> Case:
    """Return the case of the instrument: the argument with the measured free amplitude, or a case from attributes."""
    said = {name: data.attrs[name] for name in ("k", "f0", "Q") if name in data.attrs}
    free = data.attrs.get("free_amplitude", data.attrs.get("A0"))
    if case is not None:
        return case if free is None or len(case.problem.tones) > 1 else case.replace("drive.A0", float(free))
    missing = [name for name in ("k", "f0", "Q") if name not in said]
    if free is None and locked:
        free = largest
    missing += ["free_amplitude"] * (free is None)
    if missing or free is None:
        raise ParameterError(
            f"the data lack values of the instrument: {', '.join(missing)}; pass a case, or calibrate the data"
        )
    drive = {"A0": float(free)} | (
        {"frequency": float(data.attrs["drive_frequency"])} if "drive_frequency" in data.attrs else {}
    )
    found = Case(
        title=str(data.attrs.get("title", "")),
        cantilever=Cantilever(**{name: float(value) for name, value in said.items()}),
        drive=Drive(**drive),
    )
    lag = found.problem.free_lag(0)
    other = abs(float(data.attrs.get("free_phase", lag)) - lag) > SAME_LAG
    if other or abs(float(data.attrs.get("mode_share", 1.0)) - 1.0) > SAME_SHARE:
        raise ParameterError(
            "the phases and amplitudes of the data belong to the case of their calibration; pass this case"
        )
    return found


def _check(reading: CurvePoints, case: Case) -> None:
    """Raise ParameterError for curves that no force follows from."""
    problem, count = case.problem, len(reading.height)
    if len(problem.tones) > 1:
        raise ParameterError(
            f"the curve has {len(problem.tones)} tones; a force is reconstructed from curves of one tone"
        )
    if count < LEAST_POINTS:
        raise ParameterError(f"the curve has {count} usable points; a force needs {LEAST_POINTS} or more")
    if reading.amplitude.min() <= 0.0:
        raise ParameterError("the curve has an amplitude that is not above 0")
    if reading.shift is not None and (len(problem.modes) > 1 or problem.shaken is not None):
        raise ParameterError("a curve of frequency shifts needs a lever of one mode, driven by a force")
    free = float(abs(problem.detected_free[0]))
    largest = float(reading.amplitude.max())
    if reading.shift is None and problem.tones[0].frequency == problem.modes[0].f0 and largest > 1.05 * free:
        raise ParameterError(
            f"the largest amplitude, {largest * 1e9:.4g} nm, is above the free amplitude, {free * 1e9:.4g} nm: "
            "the free amplitude or the calibration is wrong"
        )
