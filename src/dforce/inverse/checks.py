"""Checks of a calibrated curve without any model of the force: whether it can be, and roughly where the surface is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core import units
from dforce.inverse.energies import Lever, force_lag, passive_margin
from dforce.inverse.free_part import SPIKE, line_of
from dforce.inverse.steps import AT_RESONANCE, Work
from dforce.inverse.values import show as shown
from dforce.results.dataset import ELECTRONVOLT

if TYPE_CHECKING:
    from dforce.case import Case

WIDE, FAR = 3.0, 5.0  # errors
BY_CHANCE = 0.005  # of the points may be below by more, as noise makes it
REPULSIVE = 5.0  # degrees below the free phase at which a point is counted as net repulsive
FEWEST = 5  # points of a slope, or around a spike
SHALLOW = 0.01  # slope of the amplitude over a sample too soft to be felt
NEAR_RESONANCE = 10.0  # degrees from 90 of a free phase: there attraction alone raises a phase
CHANGED = 2.0  # degrees from the free phase, at which a point is counted as attracted or repelled
TURN, FALL = 4.0, 0.8  # degrees, and of the free amplitude: where it falls so far, the phase turns by more
SHARP = 3.0  # times the change of slope around it: how far off a spike is
EVEN = 1.8  # median steps: a longer step may hide a jump
CLEAR = 4.0  # errors of a loss that is significant
DOUBT = "doubt: "  # begins a sentence on a possible fault in the history of a curve


def doubts(attrs: Mapping[Any, Any]) -> list[str]:
    """Return the possible faults of a measured curve that reading and calibration found, a sentence each."""
    history = attrs.get("history", [])
    lines = [history] if isinstance(history, str) else history
    return [str(line).removeprefix(DOUBT) for line in lines if str(line).startswith(DOUBT)]


def check_passive(work: Work, case: Case | None) -> None:
    """Compare every point with the limits of a passive sample, and name the points that break them."""
    attrs = work.data.attrs
    if "amplitude_2" in work.data:
        work.history.append("check without a model: skipped, because two tones may exchange energy")
        return
    if case is not None and case.problem.shaken is not None:
        work.history.append("check without a model: skipped, because the driven base exchanges energy with the sample")
        return
    ratio = float(attrs["drive_frequency"]) / float(attrs["f0"]) if {"drive_frequency", "f0"} <= set(attrs) else 1.0
    lever = Lever(1.0, float(attrs.get("Q", 1.0)), float(attrs["free_amplitude"]), ratio if "Q" in attrs else 1.0)
    amplitude, lag = work.values("amplitude"), force_lag(work.data, lever)
    turn = np.radians(np.hypot(float(attrs["phase_error"]), float(attrs.get("phase_offset_error", 0.0))))
    share = amplitude / lever.A0
    own = np.hypot(float(attrs["amplitude_error"]), share * float(attrs.get("free_amplitude_error", 0.0))) / lever.A0
    # where the sine is flat, one error of the phase still changes it by its square
    error = np.hypot(np.abs(np.cos(lag)) * turn + 0.5 * turn**2, own)
    margin = passive_margin(lever, amplitude, lag) / error
    work.data["passive_margin"] = ("point", margin)
    margin = np.where(work.kept, margin, np.inf)
    below, worst = np.flatnonzero(margin < -WIDE), int(np.argmin(margin))
    if len(below) <= np.ceil(BY_CHANCE * len(margin)) and margin[worst] > -FAR:
        which = (
            "every point" if not len(below) else f"all but {len(below)} of {len(margin)} points, consistent with noise"
        )
        work.history.append(f"check without a model: sin(phase) >= A/A0 at {which}, within {WIDE:g} errors")
        return
    where = units.show(float(work.values("height")[worst]), "m", 5)
    work.history.append(
        f"doubt: sin(phase) is below A/A0 at {len(below)} of {len(margin)} points, largest at {where}, by "
        f"{-margin[worst]:.1f} errors. Possible reasons: a wrong offset or sign of the phase, a drive off resonance, a wrong "
        f"free amplitude or its drift, base excitation, or an active sample"
    )


def check_turn(work: Work) -> None:
    """Doubt phases that hardly turn while the amplitude falls: radians taken for degrees, or a phase that was held."""
    if "frequency_shift" in work.data:
        return
    share = float(work.values("amplitude")[work.kept].min()) / float(work.data.attrs["free_amplitude"])
    turn = float(np.ptp(work.values("phase")[work.kept]))
    if share < FALL and turn < TURN:
        work.history.append(
            f"{DOUBT}the phase turns by only {turn:.2g}° while the amplitude falls to {100.0 * share:.2g} %; the file may have "
            "radians"
        )


def check_sign(work: Work) -> None:
    """Doubt the sign of phases that are first below the free one and nearer above it: a tip is attracted before it touches."""
    free = work.data["free"].values
    lag = float(work.values("phase")[free].mean()) if free.any() else AT_RESONANCE
    if abs(lag - AT_RESONANCE) > NEAR_RESONANCE or "frequency_shift" in work.data:
        return
    least = max(CHANGED, FAR * float(work.data.attrs["phase_error"]))
    for word in work.directions:
        rows = work.rows(word)
        turned = (work.values("phase") - lag)[rows[work.kept[rows]]]
        signs = np.sign(turned[np.abs(turned) > least])
        if len(signs) >= 2 * FEWEST and signs[:FEWEST].max() < 0.0 < signs[-FEWEST:].min():
            work.history.append(
                f"{DOUBT}the phase of the {word} is below the free phase far away and above it nearer: its sign may be wrong "
                "(phase_convention)"
            )


def check_spikes(work: Work) -> None:
    """Doubt single points beyond the free part, far off a cubic through their neighbors, which are as near as elsewhere."""
    height, free = work.values("height"), work.data["free"].values
    for word in work.directions:
        rows = work.rows(word)
        if len(rows) < FEWEST:
            continue
        far, near, here, nearer, nearest = (slice(k, len(rows) - 4 + k) for k in range(5))
        place, gaps = height[rows], np.abs(np.diff(height[rows]))
        even = np.max([gaps[k : len(rows) - 4 + k] for k in range(4)], axis=0) < EVEN * np.median(gaps)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (place[here] - place[near]) / (place[nearer] - place[near])
        shares = np.stack([share, np.full(len(share), 0.5)])  # uneven steps, or noise of the heights
        for name in work.channels:
            v = work.values(name)[rows]
            cubic = v[near] + shares * (v[nearer] - v[near]) + (v[near] + v[nearer] - v[far] - v[nearest]) / 6.0
            bend = np.abs(0.5 * (v[nearer] - v[near]) - np.stack([v[near] - v[far], v[nearest] - v[nearer]])).max(
                axis=0
            )
            least = np.maximum(SPIKE * float(work.data.attrs[f"{name}_error"]), SHARP * bend)
            found = rows[here][(np.abs(v[here] - cubic).min(axis=0) > least) & even & ~free[rows[here]]]
            work.note_spikes(f"{name} of the {word}", found)


def check_slope(work: Work, case: Case | None) -> None:
    """Report the slope of the amplitude over the repulsive part: 1 over a stiff sample."""
    share = 1.0 if case is None or case.problem.shaken is not None else case.problem.tip_share
    free = float(work.data.attrs.get("free_phase", AT_RESONANCE))
    for word in work.directions:
        rows = work.rows(word)
        near = rows[work.values("phase")[rows] < free - REPULSIVE]
        if len(near) < FEWEST:
            continue
        slope, spread, rest = line_of(work.values("height")[near], share * work.values("amplitude")[near])
        error = float(np.sqrt((rest**2).sum() / (len(near) - 2)) / spread)
        text = f"slope: the amplitude changes by {shown(slope, error, '1')} of the height along the repulsive {word}"
        if slope < SHALLOW - WIDE * error:
            text = f"doubt: {text}; no sample is so soft. The unit of the heights or of the amplitudes may be wrong"
        elif slope > 1.0 + WIDE * error:
            text = f"doubt: {text}; this is impossible, so the sensitivity or the height is off by {slope - 1.0:.1%} or more"
        work.history.append(text)


def estimate_offset(work: Work, case: Case | None) -> None:
    """Estimate the offset of heights from the average distance, which near the surface is about the tip's amplitude."""
    height, amplitude = work.values("height"), work.values("amplitude")
    touched = amplitude < 0.9 * float(work.data.attrs["free_amplitude"])
    if touched.sum() < FEWEST:
        work.history.append("height offset: not estimated, because the amplitude never falls to 90 %")
        return
    apart = ((1.0 if case is None else case.problem.tip_share) * amplitude - height)[touched]
    offset, spread = float(np.median(apart)), float(np.ptp(apart))
    work.data.attrs |= {"height_offset": offset, "height_offset_spread": spread}
    work.history.append(
        f"height offset: about {units.show(offset, 'm', 2)} must be added to the heights, for a stiff sample that the tip "
        f"just touches. "
        f"It varies by {units.show(spread, 'm', 2)} along the curve; a fit finds it"
    )


def tell_energies(work: Work) -> None:
    """Report the largest energy that the sample dissipates, and its error."""
    lost = work.values("dissipated_energy")
    noise, common = (work.values(f"dissipated_energy{end}") for end in ("_error", "_common_error"))
    clear = lost / np.hypot(noise, common)
    seen = (clear > CLEAR) & work.kept
    most = int(np.argmax(np.where(seen, lost, -np.inf))) if seen.any() else int(np.argmax(clear))
    where = units.show(float(work.values("height")[most]), "m", 5)
    size = (
        f"{lost[most] / ELECTRONVOLT:.3g} eV per period at {where}, with an error of {noise[most] / ELECTRONVOLT:.2g} eV from "
        f"noise and {common[most] / ELECTRONVOLT:.2g} eV common to all points"
    )
    work.history.append(
        f"energy: the sample dissipates up to {size}" if seen.any() else f"energy: no significant loss; largest {size}"
    )
