"""The interpolants of the motion within a step, and the places at which a step is cut.

A step's Hermite interpolant takes distance and velocity from both ends, and accelerations, too, where the force is smooth.
"""

from __future__ import annotations

import math
from typing import Any

from dforce.kernel.codegen import LENGTH
from dforce.kernel.linker import inlined, uncounted

MOST_CUTS = 16  # within one step
INSIDE = 1e-12  # of the free amplitude: how far beside a kink a force is taken for that on one side of it


@inlined
def cubic(s: float, h: float, x0: float, v0: float, x1: float, v1: float) -> float:
    """Return the Hermite interpolant at the share s of a step."""
    r = 1.0 - s
    return r * r * ((1.0 + 2.0 * s) * x0 + s * h * v0) + s * s * ((1.0 + 2.0 * r) * x1 - r * h * v1)


@inlined
def cubic_rate(s: float, h: float, x0: float, v0: float, x1: float, v1: float) -> float:
    """Return the slope of the Hermite interpolant at the share s of a step."""
    r = 1.0 - s
    return 6.0 * s * r * (x1 - x0) / h + r * (r - 2.0 * s) * v0 + s * (s - 2.0 * r) * v1


@inlined
def bends(h: float, x0: float, v0: float, a0: float, x1: float, v1: float, a1: float) -> Any:
    """Return the terms that the accelerations at both ends of a step add to its cubic, as `quintic` takes them."""
    rise = 3.0 * (x1 - x0)
    return 0.5 * h * h * a0 - rise + h * (2.0 * v0 + v1), 0.5 * h * h * a1 + rise - h * (v0 + 2.0 * v1)


@inlined
def quintic(s: float, h: float, x0: float, v0: float, x1: float, v1: float, b0: float, b1: float) -> float:
    """Return the Hermite interpolant that has the accelerations of both ends, too, at the share s of a step."""
    r = 1.0 - s
    return cubic(s, h, x0, v0, x1, v1) + s * s * r * r * (r * b0 + s * b1)


@inlined
def quintic_rate(s: float, h: float, x0: float, v0: float, x1: float, v1: float, b0: float, b1: float) -> float:
    """Return the slope of the quintic."""
    r = 1.0 - s
    more = s * r * (r * (2.0 * r - 3.0 * s) * b0 + s * (3.0 * r - 2.0 * s) * b1)
    return cubic_rate(s, h, x0, v0, x1, v1) + more / h


def crossing(level: float, low: float, high: float, near: float, ends: Any) -> float:
    """Return where the interpolant passes a level between two shares of a step, by Newton's steps kept in this bracket.

    It ends where it misses the level by less than `near`, a share of the step's way, or gets no farther. `ends` are as of
    `cut_at`. The last step squares the error, but may miss by half a step where the interpolant turns.
    """
    h, d0, v0, d1, v1 = ends
    at_low, at_high = cubic(low, h, d0, v0, d1, v1), cubic(high, h, d0, v0, d1, v1)
    s = low + (high - low) * (level - at_low) / (at_high - at_low)
    for _ in range(50):
        before, miss = s, cubic(s, h, d0, v0, d1, v1) - level
        if (miss > 0.0) == (at_low > level):
            low = s
        else:
            high = s
        slope = h * cubic_rate(s, h, d0, v0, d1, v1)
        s = s - miss / slope if slope != 0.0 else 0.5 * (low + high)
        if not low < s < high:
            s = 0.5 * (low + high)
        if abs(miss) < near * abs(d1 - d0) or abs(s - before) < 1e-15:
            break
    return s


def turning(h: float, d0: float, v0: float, d1: float, v1: float) -> float:
    """Return where the interpolant turns between two ends with opposite velocities: the root of a parabola."""
    rise = 6.0 * (d1 - d0) / h
    linear, square = rise - 4.0 * v0 - 2.0 * v1, 3.0 * (v0 + v1) - rise
    root = math.sqrt(max(linear * linear - 4.0 * square * v0, 0.0))
    q = -0.5 * (linear + (root if linear > 0.0 else -root))  # the sum of two numbers of one sign: no digits are lost
    s = v0 / q if q != 0.0 else 0.5
    if not 0.0 <= s <= 1.0:
        s = q / square if square != 0.0 else 0.5
    return min(max(s, 0.0), 1.0)


def insert(cuts: Any, count: int, s: float, event: float) -> int:
    """Put a cut, and the event that it is made for, in its place in the ordered list; return the new count."""
    if s <= 0.0 or s >= 1.0 or count >= MOST_CUTS:
        return count
    k = count
    while k > 0 and cuts[0, k - 1] > s:
        cuts[0, k], cuts[1, k] = cuts[0, k - 1], cuts[1, k - 1]
        k -= 1
    cuts[0, k], cuts[1, k] = s, event
    return count + 1


def cut_at(cuts: Any, count: int, level: float, event: float, turn: float, ends: Any) -> int:
    """Add the places where a step, which may turn on the way, passes a level; return how many cuts there are.

    `ends` are the length of the step, and distance and velocity at either end.
    """
    h, d0, v0, d1, v1 = ends
    d_turn = cubic(turn, h, d0, v0, d1, v1) if turn > 0.0 else d0
    if turn > 0.0 and (d0 - level) * (d_turn - level) < 0.0:
        count = insert(cuts, count, crossing(level, 0.0, turn, 0.0, ends), event)
    if (d_turn - level) * (d1 - level) < 0.0:
        count = insert(cuts, count, crossing(level, turn, 1.0, 0.0, ends), event)
    return count


def fastest(h: float, d0: float, v0: float, d1: float, v1: float) -> float:
    """Return the largest speed on the cubic, whose slope is a parabola."""
    speed = max(abs(v0), abs(v1))
    rise = 6.0 * (d1 - d0) / h
    first, last = rise - 4.0 * v0 - 2.0 * v1, 2.0 * v0 + 4.0 * v1 - rise  # h times the acceleration at either end
    if first * last < 0.0:
        speed = max(speed, abs(cubic_rate(first / (first - last), h, d0, v0, d1, v1)))
    return speed


@uncounted
def between_kinks(d: float, kinks: Any, p: Any) -> Any:
    """Return the distances of the kinks on either side of a distance, both just inside."""
    low, high = -math.inf, math.inf
    for kink in kinks:
        if kink < d:
            low = max(low, kink)
        else:
            high = min(high, kink)
    inside = INSIDE * p[LENGTH]
    return low + inside, high - inside


def held(d: float, limits: Any) -> float:
    """Return a distance held within limits, so that every stage of a step sees the same side of a kink."""
    if limits is None:
        return d
    return min(max(d, limits[0]), limits[1])
