"""Advice where a curve hides another steady state, or an amplitude occurs at several distances."""

from __future__ import annotations

import math

import numpy as np

from dforce.core.units import show, show_range
from dforce.experiments import Approach
from dforce.validity._advice import Advice, shown
from dforce.validity._evidence import Evidence

DISTINCT = 0.01  # of the free amplitude: states that differ by less are one
GAP = 3.0  # drop of the amplitude per step of the distance; on a hard sample it is 1
BISTABLE = "R. García, A. San Paulo, Phys. Rev. B 61, R13381 (2000)"


def coexisting_states(seen: Evidence) -> Advice | None:
    """Look for distances at which two stable states were found: on branches, by two directions, from several starts."""
    found = _states_at_one_distance(seen) or _runs_that_overlap(seen) or _ways_that_differ(seen) or _jumps(seen)
    if found is None:
        return None
    return Advice(
        "coexisting_states",
        2,
        1,
        f"{found}. The state in an experiment depends on approach, noise and feedback. Identify the measured state by its "
        'phase, or avoid this range with another A0; experiment.kind = "basins" shows their shares.',
        BISTABLE,
        ("experiment.zc", seen.of_tone(0, "A0")),
    )


def _states_at_one_distance(seen: Evidence) -> str | None:
    states = 0 if seen.result is None else seen.result.sizes.get("state", 0)
    return f"{states} stable states exist at this distance" if states > 1 else None


def _runs_that_overlap(seen: Evidence) -> str | None:
    """Return the range where two stable stretches of branches overlap."""
    stable, along = seen.stable, seen.result.attrs.get("along") if seen.result is not None else None
    x, branch = seen.array(str(along)), seen.array("branch")
    if stable is None or x is None or branch is None or x.size < 2:
        return None
    turn = np.sign(np.diff(x))
    cut = (np.diff(branch) != 0) | ~stable[1:] | ~stable[:-1] | (np.append(turn[0], turn[:-1]) != turn)
    runs = [run for run in np.split(np.arange(x.size), np.flatnonzero(cut) + 1) if run.size > 1 and stable[run].all()]
    ends = sorted((float(x[run].min()), float(x[run].max())) for run in runs)
    common = [(b[0], min(a[1], b[1])) for i, a in enumerate(ends) for b in ends[i + 1 :] if b[0] < a[1]]
    if not common or seen.result is None:
        return None
    unit = str(seen.result.variables[str(along)].attrs.get("units", "1"))
    low, high = min(pair[0] for pair in common), max(pair[1] for pair in common)
    return f"{_where(low, high, unit)} two stable states exist"


def _ways_that_differ(seen: Evidence) -> str | None:
    motion, x = seen.motion, seen.array(seen.along)
    if x is None or motion.ndim != 2 or motion.shape[1] != 2:
        return None
    apart = np.abs(motion[:, 0] - motion[:, 1]) > DISTINCT * seen.problem.tones[0].A0  # NaN is not apart
    if not apart.any():
        return None
    ways, unit = ("approach and retract", "m") if seen.along == "zc" else ("the sweeps up and down", "Hz")
    return f"{_where(float(x[apart].min()), float(x[apart].max()), unit)} {ways} end in different states"


def _where(low: float, high: float, unit: str) -> str:
    """Return one place, or a range with the digits that show its width."""
    if low == high:
        return f"At {show(low, unit, 5)}"
    digits = max(3, 1 + math.ceil(math.log10(max(abs(low), abs(high)) / (high - low))))
    return f"Between {show_range(low, high, unit, digits, 'and')}"


def _jumps(seen: Evidence) -> str | None:
    for name, unit in (("jump_zc", "m"), ("jump_frequency", "Hz")):
        at = seen.array(name)
        at = np.empty(0) if at is None else at[np.isfinite(at)]  # curves of a sweep are filled up to the same number
        if at.size:
            return (
                f"The motion jumped to another state at {shown(float(at[0]), unit)}; near this place both states exist"
            )
    return None


def set_point_met_twice(seen: Evidence) -> Advice | None:
    """Look for an amplitude that grows while the distance falls: a feedback meets it at several distances."""
    least = DISTINCT * seen.problem.tones[0].A0
    for way, zc, amplitude in seen.curves:
        if amplitude.size < 2:
            continue
        rise = amplitude - np.minimum.accumulate(amplitude)
        top = int(np.argmax(rise))
        if rise[top] > least:
            low = float(amplitude[: top + 1].min())
            return Advice(
                "set_point_met_twice",
                float(rise[top]),
                least,
                f"On the {way} the amplitude steps up from {show_range(low, float(amplitude[top]), 'm', 3)} at zc = "
                f"{shown(float(zc[top]), 'm')}: such set points occur at several distances, and a feedback jumps "
                "between them. Choose a set point outside of this range, or another A0.",
                BISTABLE,
                ("experiment.zc", seen.of_tone(0, "A0")),
                "m",
            )
    return None


def set_point_unreachable(seen: Evidence) -> Advice | None:
    """Look for an amplitude that falls by a jump: between its ends a feedback finds no distance."""
    least = DISTINCT * seen.problem.tones[0].A0
    for way, zc, amplitude in seen.curves:
        drops = -np.diff(amplitude)
        for i in np.flatnonzero((drops > least) & (drops > GAP * -np.diff(zc))):
            high, low = amplitude[i], amplitude[i + 1]
            if np.any((amplitude > low) & (amplitude < high)):
                continue  # met elsewhere
            return Advice(
                "set_point_unreachable",
                float(high - low),
                least,
                f"On the {way} the amplitude falls from {show_range(float(high), float(low), 'm', 3)} between "
                f"{show_range(float(zc[i]), float(zc[i + 1]), 'm', 3, 'and')}: set points between them do not exist, and a "
                "feedback drives the tip through the jump. Choose a set point outside of this range.",
                BISTABLE,
                ("experiment.zc", seen.of_tone(0, "A0")),
                "m",
            )
    return None


def begins_in_contact(seen: Evidence) -> Advice | None:
    """Look for an approach that begins where the tip touches already: its first state then depends on the start alone."""
    experiment, problem = seen.case.experiment, seen.problem
    if not isinstance(experiment, Approach) or experiment.direction == "retract":
        return None
    first = float(experiment.distances(problem.tones[0].A0).max())
    free = float(np.abs(problem.free).sum() + np.abs(problem.base).sum())
    nearest = _closest_at_first(seen)
    if first - free > problem.a0 and not nearest < problem.a0:
        return None
    touches = (
        f"the closest distance there is {shown(nearest, 'm')}" if nearest < problem.a0 else "the free motion reaches it"
    )
    far = 1.2 * free + problem.a0
    return Advice(
        "begins_in_contact",
        first,
        free + problem.a0,
        f"The approach begins at {shown(first, 'm')}, where the tip with a free amplitude of {shown(free, 'm')} touches the "
        f"sample: {touches}. Its state depends on the start, and an approach from far away may lead to another "
        f"state. Begin experiment.zc at {shown(far, 'm')}, or write it as shares of drive.A0.",
        BISTABLE,
        ("experiment.zc", seen.of_tone(0, "A0")),
        "m",
    )


def _closest_at_first(seen: Evidence) -> float:
    """Return the closest distance (m) at the first point of an approach; infinite where no result has it."""
    closest, zc = seen.array("min_distance"), seen.array("zc")
    if seen.along != "zc" or closest is None or zc is None:
        return math.inf
    values = closest[int(np.argmax(zc))].ravel()  # of both directions the first is the approach
    return float(values[0]) if np.isfinite(values[0]) else math.inf


PIECES = (begins_in_contact, coexisting_states, set_point_met_twice, set_point_unreachable)
