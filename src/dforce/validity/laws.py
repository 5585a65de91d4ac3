"""The laws of the forces at the distances and velocities of a motion."""

from __future__ import annotations

import math

import numpy as np

from dforce.core.arrays import Array
from dforce.core.units import show
from dforce.forces import Force, in_first_contact
from dforce.results.status import WITHOUT_RESULT, repeats
from dforce.validity._advice import JOINED, Advice, percent
from dforce.validity._evidence import Evidence

PLACES = 512  # distances that a law is asked for
ANOTHER = 0.05  # of the largest force: a difference that no sampling makes
AWAY = 1e-6  # m: farther than any tip moves
ALONE = ("d", "rate", "t")  # arguments of a law without memory, branch and average distance
AROUND = 1.5  # free amplitudes that a motion may reach beyond the average distances before it ends


def force_at(seen: Evidence, force: Force, d: float, rate: float) -> float:
    """Return a force (N) in first contact, at the farthest distance of the experiment; NaN where it has no value."""
    return in_first_contact(force, d, rate, (seen.range_of_zc or (d, d))[0])


def _lost(seen: Evidence) -> tuple[int, str]:
    """Return how many points have no result, or at how many values branches lack states, and the words for it."""
    status, sums, force = seen.array("status"), seen.array("index_sum"), seen.array("force")
    if sums is not None:
        lost = int((sums != 1).sum())
        return lost, f"states are missing at {lost} of {sums.size} searched values"
    if status is None and force is not None:
        lost = int((~np.isfinite(force)).sum())
        return lost, f"{lost} of {force.size} forces have no value"
    lost = 0 if status is None else int(np.isin(status, WITHOUT_RESULT).sum())
    return lost, "" if status is None else f"{lost} of {status.size} points have no result"


def _reached(seen: Evidence) -> tuple[Array, float]:
    """Return distances (m) that the tip may have reached, from far to near, and its largest speed (m/s)."""
    zc, distance, velocity = (seen.array(name) for name in ("zc", "distance", "velocity"))
    if distance is not None and zc is None:
        return np.sort(distance)[::-1], 0.0 if velocity is None else float(np.abs(velocity).max(initial=0.0))
    if zc is None or not np.isfinite(zc).any():
        return np.zeros(0), 0.0
    tone = seen.problem.tones[0]
    reach = AROUND * max(tone.A0, abs(seen.problem.base[0]))
    places = np.linspace(np.nanmax(zc) + reach, np.nanmin(zc) - reach, PLACES)
    return places, 2.0 * math.pi * tone.frequency * reach


def law_without_value(seen: Evidence) -> Advice | None:
    """Look for a law of the user's own that is no finite number where results are missing."""
    lost, words = _lost(seen)
    if lost == 0:
        return None
    places, speed = _reached(seen)
    for force in seen.problem.forces:
        for d in () if force.is_passive else places.tolist():
            for rate in (0.0, -speed, speed):
                value = force_at(seen, force, d, rate)
                if not math.isfinite(value):
                    at = f"d = {show(d, 'm', 3)}" + (f" and a velocity of {show(rate, 'm/s', 3)}" if rate else "")
                    return Advice(
                        "law_without_value",
                        lost,
                        0,
                        f"The law of {force.name} gives no finite number at {at}, and {words}. Make the law finite at every "
                        "distance and velocity that the tip reaches, as max(d, a0) does.",
                        "values of the law",
                        (seen.path(force),),
                    )
    return None


def other_forces(seen: Evidence) -> Advice | None:
    """Compare the range of the forces at each point with the laws at its closest distance, where the velocity is zero.

    The largest value of a law of the distance alone, from there to far away, is not below the peak force.
    """
    forces, names = seen.problem.forces, ("min_distance", "min_force", "peak_force", "status")
    arrays = [array for name in names if (array := seen.array(name)) is not None and array.size]
    of_other = getattr(seen.case.experiment, "parameter", None) is not None
    if not forces or of_other or len({array.shape for array in arrays}) != 1 or len(arrays) != len(names):
        return None
    if any(force.leading() != ALONE or force.timed for force in forces):
        return None
    taken = repeats(arrays[-1]) & np.isfinite(sum(arrays[:-1]))
    near, low, high = (array[taken] for array in arrays[:-1])
    limit = ANOTHER * np.max(np.abs([low, high]), initial=0.0)
    there = _total(seen, near)
    off = np.maximum(there - high, low - there)
    if all(force.is_of_distance_alone for force in forces):
        most = np.maximum(there, _total(seen, np.max(near, initial=0.0, keepdims=True) + AWAY))
        for i in np.flatnonzero(high - most > limit):
            way = near[i] + np.geomspace(1e-4 * seen.problem.a0, AWAY, PLACES)
            off[i] = max(off[i], high[i] - _total(seen, way).max())
    found = float(np.max(off, initial=0.0))
    if not found > limit:
        return None
    share = float(ANOTHER * found / limit)
    return Advice(
        "other_forces",
        share,
        ANOTHER,
        f"Forces differ by {percent(share)} of the largest force from the force laws of the case{JOINED}",
        "values of the laws at the closest distance",
        ("forces",),
    )


def _total(seen: Evidence, distances: Array) -> Array:
    """Return the sum of the forces (N) on a tip at rest at distances (m)."""
    laws = [(force.plain_law(), force.values()) for force in seen.problem.forces]
    return np.array([sum(law(d, 0.0, 0.0, *values) for law, values in laws) for d in distances.tolist()])


PIECES = (law_without_value, other_forces)
