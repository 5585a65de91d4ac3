"""Events of a step: kinks that it passes, grazes or turns behind, and branches that switch on the way.

`forces` is described in ``loops``.
"""

from __future__ import annotations

from typing import Any

from dforce.kernel.codegen import LENGTH
from dforce.kernel.vocabulary import coasted, distance, force, latch_count, rate_of, switch
from dforce.observables.interpolant import INSIDE, cubic, turning

JUMPS = 1e-3  # of the forces on both sides: a larger difference is a jump


def risen(y: Any, t: float, latched: Any, p: Any) -> int:
    """Return the first latch whose switching function is above zero, or -1."""
    d = distance(y, p)
    rate = rate_of(y, p)
    for which in range(latch_count(latched)):
        if switch(which, latched, d, rate, t, p) > 0.0:
            return which
    return -1


def passed(y: Any, end: Any, t: float, forces: Any, p: Any) -> int:
    """Return which kink (0, 1, ...) or latch (counted on from the kinks) lies between two motions, or -1.

    Of several kinks it is the first on the motion's way. `t` is the time (s) of the second motion.
    """
    _, latched, kinks, _ = forces
    d0, d1, first = distance(y, p), distance(end, p), -1
    for which in range(kinks.shape[0]):
        if (d0 > kinks[which]) != (d1 > kinks[which]) and (
            first < 0 or abs(kinks[which] - d0) < abs(kinks[first] - d0)
        ):
            first = which
    if first >= 0:
        return first
    which = risen(end, t, latched, p)
    return which + kinks.shape[0] if which >= 0 else -1


def grazes(y: Any, h: float, kinks: Any, p: Any) -> bool:
    """Return whether a step that begins and ends on one side of a kink may reach its other side on the way.

    Neither the parabola through the step nor the stages of the method reach farther than the tangent from the start to the
    middle of the step.
    """
    d, middle = distance(y, p), distance(coasted(y, 0.5 * h), p)
    found = False
    for kink in kinks:
        found |= (d > kink) != (middle > kink)
    return found


def touches_a_jump(y: Any, h: float, t: float, forces: Any, p: Any) -> bool:
    """Return whether the force jumps at a kink that a step may touch.

    Where the force only bends, a step that dips behind the kink and back is left whole. Its error vanishes with the depth of
    the dip, while a cut would change the error of the step at once.
    """
    memory, latched, kinks, _ = forces
    d, middle, rate, found = distance(y, p), distance(coasted(y, 0.5 * h), p), rate_of(y, p), False
    aside = INSIDE * p[LENGTH]
    for kink in kinks:
        if (d > kink) != (middle > kink):
            above = force(kink + aside, rate, t, memory, latched, p)
            below = force(kink - aside, rate, t, memory, latched, p)
            found |= abs(above - below) > JUMPS * (abs(above) + abs(below))
    return found


def turn_behind(y: Any, end: Any, dt: float, kinks: Any, p: Any) -> float:
    """Return the share of a step of length `dt` (s) at which the motion turns behind a kink that both ends lie before, or 0."""
    d0, v0, d1, v1 = distance(y, p), rate_of(y, p), distance(end, p), rate_of(end, p)
    if v0 * v1 < 0.0:
        share = turning(dt, d0, v0, d1, v1)
        farthest = cubic(share, dt, d0, v0, d1, v1)
        for kink in kinks:
            if (d0 > kink) == (d1 > kink) and (d0 > kink) != (farthest > kink):
                return share
    return 0.0


def margin(which: int, y: Any, end: Any, t: float, forces: Any, p: Any) -> float:
    """Return how far a motion is past an event that `passed` found: negative before it, positive after."""
    _, latched, kinks, _ = forces
    if which < kinks.shape[0]:
        past = distance(end, p) - kinks[which]
        return -past if distance(y, p) > kinks[which] else past
    return switch(which - kinks.shape[0], latched, distance(end, p), rate_of(end, p), t, p)
