"""The laws of the forces at the distances and velocities of a motion."""

from __future__ import annotations

import math

import numpy as np

from dforce.core.arrays import Array
from dforce.core.units import show
from dforce.forces import Force, in_first_contact
from dforce.results.status import WITHOUT_RESULT
from dforce.validity._advice import Advice
from dforce.validity._evidence import Evidence

PLACES = 512  # distances that a law is asked for
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


PIECES = (law_without_value,)
