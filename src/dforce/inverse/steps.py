"""The steps of the calibration; each changes the curve in place and adds a sentence to its history."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dforce.core import units
from dforce.core.arrays import Array, Bools, Indices
from dforce.core.errors import ParameterError
from dforce.inverse.free_part import FLAT, WIDE, FreeChannel, fewest, free_count, is_drift, steady, steady_stretch
from dforce.inverse.heights import WAYS
from dforce.inverse.table import APPROACH
from dforce.inverse.values import show as shown

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case

UNITS = {"amplitude": "m", "phase": "deg", "amplitude_2": "m", "phase_2": "deg", "frequency_shift": "Hz"}
TONES = (("amplitude", "phase", "", 0), ("amplitude_2", "phase_2", "_2", 1))
RATIOS = (
    (math.sqrt(2.0), "rms instead of zero to peak"),
    (0.5, "peak to peak instead of zero to peak"),
    (1.0 / math.sqrt(2.0), "zero to peak, multiplied like rms"),
)
NEAR = 0.03  # of a ratio
FAR_FORCES = "it cannot be distinguished from long-range forces"  # a drift of a short free part
LEFT_OUT = "a fit leaves out this point"  # of a spike
DRIFT, TURNED = 0.05, 5.0  # of the amplitude, and degrees: a larger change along a stretch is no drift
LONG = 0.25  # of a direction: along a shorter stretch a straight line may as well be the tail of a force
AT_RESONANCE = 90.0  # degrees


class Given(NamedTuple):
    """The user's statements on the free part and the noise, in SI units and degrees."""

    free_part: tuple[float, float] | None
    free_amplitude: float | None
    free_phase: float | None
    errors: dict[str, float]
    baseline: str


@dataclass
class Work:
    """A curve that is being calibrated, and the sentences so far."""

    data: xr.Dataset
    history: list[str]
    given: Given
    free: dict[str, Indices] = field(default_factory=dict)
    tilted: dict[str, bool] = field(default_factory=dict)
    found: dict[str, dict[str, FreeChannel]] = field(default_factory=dict)

    def values(self, name: str) -> Array:
        """Return the numbers of a variable."""
        return np.asarray(self.data[name].values, dtype=float)

    @property
    def channels(self) -> list[str]:
        """The quantities that were measured at each height."""
        return [name for name in UNITS if name in self.data]

    @property
    def kept(self) -> Bools:
        """Which rows are no spikes."""
        return np.asarray(~self.data["spike"].values)

    def note_spikes(self, name: str, rows: Indices) -> None:
        """Mark rows with a spike in a channel, if there are any, and doubt them."""
        if len(rows):
            self.data["spike"][rows] = True
            told = ", ".join(units.show(float(self.data["height"][row]), "m", 5) for row in rows)
            self.history.append(f"doubt: the {name} has a spike at {told}; {LEFT_OUT}")

    def rows(self, direction: str) -> Indices:
        """Return the rows of a direction, from the far end to the near one."""
        rows = np.flatnonzero(self.data["direction"].values == direction)
        return rows if direction == APPROACH else rows[::-1]

    @property
    def directions(self) -> list[str]:
        """The directions that the curve has, the approach first."""
        there = set(self.data["direction"].values.tolist())
        return [word for word in WAYS if word in there]


def take_delay(work: Work, delay: float, speed: float | None) -> None:
    """Give each point the height at which it was measured, a delay earlier."""
    height = work.values("height")
    if speed is None and "time" not in work.data:
        raise ParameterError("delay needs the speed of the heights (speed = '100 nm/s'), because the curve has no time")
    for word in work.directions:
        rows = work.rows(word)[:: 1 if word == APPROACH else -1]  # in the order of time
        if speed is not None:
            height[rows] -= WAYS[word] * speed * delay
            continue
        time, own = work.values("time")[rows], height[rows].copy()
        if not (np.diff(time) > 0.0).all():
            raise ParameterError("delay: the times of the curve do not rise from point to point; pass speed instead")
        start = (own[1] - own[0]) / (time[1] - time[0])
        height[rows] = np.interp(time - delay, time, own) + np.minimum(time - delay - time[0], 0.0) * start
    work.data["height"] = ("point", height)
    how = "by its time" if speed is None else f"{units.show(speed, 'm/s', 4)} times that"
    work.history.append(f"delay: each point has the height of {units.show(delay, 's', 4)} before ({how})")


def find_free_part(work: Work) -> None:
    """Find the free part of each direction, and the noise in it."""
    height = work.values("height")
    work.data["spike"] = ("point", np.zeros(len(height), bool))
    for word in work.directions:
        rows = work.rows(word)
        if work.given.free_part is not None:
            low, high = work.given.free_part
            chosen = rows[(height[rows] >= low) & (height[rows] <= high)]
            count, tilted = (len(chosen), False) if len(chosen) >= 3 else (0, False)
        else:
            channels = {name: work.values(name)[rows] for name in work.channels}
            allowed, drifting = [_allowed(*one) for one in channels.items()], ["amplitude" in name for name in channels]
            count, tilted = free_count(height[rows], channels.values(), allowed, drifting)
            chosen = rows[:count]
        if not count:
            continue
        work.free[word], work.tilted[word] = chosen, tilted
        work.found[word] = {name: steady_stretch(height[chosen], work.values(name)[chosen]) for name in work.channels}
        low, high = sorted((float(height[chosen[0]]), float(height[chosen[-1]])))
        how = ", as set" if work.given.free_part is not None else ", along a drift" if tilted else ""
        work.history.append(f"free part: {count} points of the {word}, from {units.show_range(low, high, 'm', 5)}{how}")
        for name in work.channels:
            work.note_spikes(f"free {name} of the {word}", chosen[~steady(work.values(name)[chosen])])
    _refuse_no_free_part(work)
    every = np.concatenate([*work.free.values(), np.zeros(0, dtype=int)])
    work.data["free"] = ("point", np.isin(np.arange(len(height)), every))


def _allowed(name: str, values: Array) -> float:
    """Return by how much a channel may drift along a free part."""
    if name in ("amplitude", "amplitude_2"):
        return DRIFT * float(np.median(values[: fewest(len(values))]))
    return TURNED if name in ("phase", "phase_2") else math.inf


def _refuse_no_free_part(work: Work) -> None:
    if work.free:
        return
    if work.given.free_part is not None:
        asked = units.show_range(*work.given.free_part, "m", 5)
        raise ParameterError(f"free_part: fewer than 3 points lie from {asked}")
    needed = [name for name in work.channels if name not in work.given.errors]
    missing = [
        *(["free_amplitude"] if work.given.free_amplitude is None else []),
        *(["free_phase"] if work.given.free_phase is None else []),
        *(f"errors of {name}" for name in needed),
    ]
    if missing:
        raise ParameterError(
            f"the curve has no free part: no {fewest(work.data.sizes['point'])} points at its far end are all alike; "
            f"pass {', '.join(missing)}, or the heights of a free part"
        )
    work.history.append("free part: none; free amplitude, free phase and errors as set")


def level(work: Work) -> None:
    """Subtract a drift of the free part, as a straight line, from the whole direction."""
    height = work.values("height")
    for word, found in work.found.items():
        for name, part in found.items():
            if not part.slope_error or abs(part.slope) <= FLAT * part.slope_error:
                continue
            if not work.tilted[word] and work.given.free_part is None:
                continue  # flat, within the noise, over the longer stretch that it was found in
            rows = work.rows(word)
            reach = float(height[work.free[word]].mean() - height[rows].min())
            unit = UNITS[name]
            text = (
                f"the {name} of the {word} drifts along the free part, by "
                f"{shown(part.slope * reach, part.slope_error * reach, unit)} from there to the nearest point"
            )
            if work.given.baseline == "none" and work.tilted[word]:
                raise ParameterError(f"{text}; baseline = 'line' subtracts a drift")
            values, own, long = work.values(name), work.free[word], len(work.free[word]) >= LONG * len(rows)
            if work.tilted[word] and long and abs(part.slope) <= WIDE * part.slope_error:
                continue  # a line through few points would add more noise than it takes away
            likely = "amplitude" in name or is_drift(height[own], values[own])  # forces far away change the phase first
            if not (work.tilted[word] and long and likely):
                why = FAR_FORCES if work.tilted[word] else "the free part was set"
                work.history.append(f"doubt: {text}; nothing is subtracted, because {why}")
                continue
            values[rows] -= part.slope * (height[rows] - height[own].mean())
            work.data[name] = ("point", values)
            found[name] = steady_stretch(height[own], values[own])
            work.history.append(f"drift: {text}; the line is subtracted")


def together(work: Work, name: str) -> tuple[float, float]:
    """Return the mean of a channel and its error, over the free parts of both directions."""
    parts = [(word, found[name]) for word, found in work.found.items()]
    silent = any(part.error == 0.0 for _, part in parts)
    weights = np.array([part.points if silent else part.error**-2.0 for _, part in parts], dtype=float)
    mean = float((weights * [part.mean for _, part in parts]).sum() / weights.sum())
    error = 0.0 if silent else float(1.0 / np.sqrt(weights.sum()))
    if len(parts) == 2:
        apart = parts[0][1].mean - parts[1][1].mean
        if abs(apart) > WIDE * math.hypot(parts[0][1].error, parts[1][1].error):
            error = math.hypot(error, 0.5 * apart)
            work.history.append(
                f"doubt: the free {name} drifts, by {shown(-apart, None, UNITS[name])} from approach to retract; "
                "half of this is added to its error"
            )
    return mean, error


def take_amplitudes(work: Work, case: Case | None) -> None:
    """Take free amplitudes and the noise of every channel from the free part, or as given."""
    attrs = work.data.attrs
    correlations = [(part.correlation, part.points) for found in work.found.values() for part in found.values()]
    count = sum(number for _, number in correlations)
    mean = sum(r * number for r, number in correlations) / count if count else 0.0
    significant = count > 0 and mean > FLAT / math.sqrt(count)
    attrs["neighbor_correlation"] = float(mean) if significant else 0.0
    work.history.append(
        f"neighbors: correlated by {mean:.2f}" if significant else "neighbors: no correlation above the noise"
    )
    for name in work.channels:
        noise = work.given.errors.get(name)
        if noise is None:
            noise = together_noise(work, name)
            if noise == 0.0:
                raise ParameterError(
                    f"the {name} is equal at every point of the free part, so its noise is unknown; "
                    f"write errors = {{'{name}': ...}}"
                )
            attrs["noise_points"] = sum(map(len, work.free.values()))
        attrs[f"{name}_error"] = noise
        source = "as set" if name in work.given.errors else "from the free part"
        work.history.append(f"noise: {shown(noise, None, UNITS[name])} of the {name}, {source}")
    for amplitude, _, ending, tone in TONES:
        if amplitude not in work.data:
            continue
        own = work.given.free_amplitude if not ending else None
        if own is not None:
            attrs[f"free_amplitude{ending}"] = own
            work.history.append(f"free amplitude: {units.show(own, 'm', 5)}, as set")
            if work.found:
                _compare(work, together(work, amplitude)[0], own, "in your settings")
        elif work.found:
            mean, error = together(work, amplitude)
            attrs |= {f"free_amplitude{ending}": mean, f"free_amplitude{ending}_error": error}
            work.history.append(f"free amplitude{' of tone 2' if ending else ''}: {shown(mean, error, 'm')}")
            if case is not None and len(case.problem.tones) > tone:
                _compare(work, mean, case.problem.tones[tone].A0, "of the case")


def together_noise(work: Work, name: str) -> float:
    """Return the noise of a channel over all free parts."""
    parts = [found[name] for found in work.found.values()]
    return float(np.sqrt(np.average([part.noise**2 for part in parts], weights=[part.points for part in parts])))


def _compare(work: Work, found: float, wanted: float, whose: str) -> None:
    """Report a free amplitude that differs from the expected one, and the mistake that would explain it."""
    ratio = wanted / found
    for factor, mistake in RATIOS:
        if abs(ratio / factor - 1.0) < NEAR:
            work.history.append(
                f"doubt: the free amplitude {whose} is {ratio:.3f} times the measured value; the file may contain {mistake}"
            )
            return
    if abs(ratio - 1.0) > NEAR:
        work.history.append(f"doubt: the free amplitude {whose} is {ratio:.3f} times the measured value")


def take_phases(work: Work, case: Case | None) -> None:
    """Let phases count from the free part, which has the lag of the free motion."""
    for _, name, ending, tone in TONES:
        if name not in work.data:
            continue
        lag, why = _free_lag(work, case, tone)
        work.data.attrs[f"free_{name}"] = lag
        if work.given.free_phase is not None and not ending:
            free, error = work.given.free_phase, 0.0
        elif work.found:
            mean, error = together(work, name)
            change = max(
                (abs(found[name].slope) + found[name].slope_error)
                * float(np.ptp(work.values("height")[work.free[word]]))
                for word, found in work.found.items()
            )
            free, error = mean, math.hypot(error, change)
        else:
            continue
        work.data[name] = work.data[name] - (free - lag)
        work.data.attrs[f"{name}_offset"] = free - lag
        if error > 0.0:
            work.data.attrs[f"{name}_offset_error"] = error
        text = shown(free - lag, error if error > 0.0 else None, "deg")
        work.history.append(
            f"{name}: the free part is set to {lag:.2f}° ({why}), by an offset of {text}; the error includes "
            "changes along the free part"
            if work.given.free_phase is None
            else f"{name}: your free phase is set to {lag:.2f}° ({why}), by an offset of {text}"
        )


def _free_lag(work: Work, case: Case | None, tone: int) -> tuple[float, str]:
    """Return the lag of the free motion (degrees), and where it is known from."""
    if case is not None and len(case.problem.tones) > tone:
        return case.problem.free_lag(tone), "the free lag of the case"
    known = work.data.attrs
    if tone == 0 and {"f0", "Q", "drive_frequency"} <= set(known):
        r = float(known["drive_frequency"]) / float(known["f0"])
        return math.degrees(math.atan2(r / float(known["Q"]), 1.0 - r * r)), "by f0, Q and the drive frequency"
    return AT_RESONANCE, "for a drive at resonance"
