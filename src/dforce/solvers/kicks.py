"""What a step of the distance does to the motion: it stands off the orbit that continues its state, as if it were kicked.

How hard the kick is shows in one period of the map; where a hard one ends only the motion itself can tell.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.kernel.link import inlined
from dforce.kernel.slots import at_distance, from_vector, mode_count
from dforce.solvers.guess import correction
from dforce.solvers.lanes import filled, lanes_over_common_period, park
from dforce.solvers.rk4 import over_common_period

SMALL = 1e-4  # of the free amplitude: a smaller kick is none
LARGE = 0.2  # of the free amplitude: after a larger kick the first period does not show yet where the motion goes
SUSPECT = 0.05  # share of the way to other states, as estimated from two tangents, from which on the map is asked
MOST_STEPS, EXPECTED, MORE = 4, 0.2, 1.2  # steps without asking; share expected, and growth of the estimate, until then
PATIENCE = 3  # steps beside a kink where the force has no jumps
MEMO = 5  # numbers that `is_suspect` keeps
HARD = 0.8  # share from which on it is open where the motion ends
OVERSHOOT = 1.5  # times a step in distance: how much nearer the tip may come before it has settled
LOOKS, REST = 32, 7  # looks at a motion after a kick before it is left to settle, and common periods between them
NEAR = 0.3  # share of the way to other states from which on a motion stays
SPANS = 3  # decay times over which looks are spread at least
GONE = 10.0  # times the kick: a motion so far off goes elsewhere
CALMED = 0.8  # share of the farthest it was off the orbit that is left then at most
CLEAR = 0.01  # share of the way to other states at which a motion away from kinks stays whatever is left of the kick
EXCURSION = 2.0  # times the kick: how much nearer the tip comes at most
FEW = 2  # motions up to which one after the other is quicker than side by side


@inlined
def are_lanes_enough(memory: Any, latched: Any) -> bool:
    """Say whether motions can be marched side by side: the force is a function of the motion."""
    return bool(memory.shape[0] == 0 and latched.shape[0] == 0)


def suspicion(
    orbits: Any, tangents: Any, nearest: Any, zc: Any, i: int, kinks: Any, bent: Any, matrix: Any, away: Any
) -> float:
    """Return roughly how hard the step to orbit i kicks: as tangents change; infinite where it may take the tip past a kink.

    `nearest` holds the least distances on the orbits before it and on it. `bent`, `matrix` and `away` are scratch.
    """
    size, largest, farthest = 2 * mode_count(), 0.0, 0.0
    for a in range(size):
        bent[a] = 0.0
        for b in range(size):
            bent[a] += 0.5 * (tangents[i - 1, a, b] - tangents[i, a, b]) * (orbits[i - 1, b] - orbits[i, b])
        largest = max(largest, abs(orbits[i - 1, a] - orbits[i, a]))
    if largest < SMALL:
        return 0.0
    reached = nearest[0] + OVERSHOOT * (zc[i] - zc[i - 1])
    for kink in kinks:
        if (nearest[0] > kink) == (nearest[1] > kink) != (reached > kink):
            return np.inf
    correction(tangents[i], bent, matrix, away)
    for a in range(size):
        farthest = max(farthest, abs(away[a]))
    return farthest / largest


def is_suspect(share: float, patience: int, memo: Any) -> bool:
    """Say whether the map has to be asked how hard a step kicks that is suspected of this share.

    Along a curve the one follows the other: not where little is expected, as both were when the map was asked last. Beside
    a kink of the force nothing can be expected, but for some steps, the `patience`, after it kicked little. `memo` holds
    what was suspected and what was found, how many steps ago that was, and both of the latter beside a kink.
    """
    memo[2] += 1.0
    memo[4] += 1.0
    if share == np.inf:
        return bool(memo[3] > SUSPECT or memo[4] > patience)
    if share <= SUSPECT:
        return False
    expected = memo[1] * share / memo[0] if memo[0] > 0.0 else np.inf
    return bool(memo[2] > MOST_STEPS or expected > EXPECTED or share > MORE * memo[0])


def patience(jumps: int) -> int:
    """Return for how many steps beside a kink the map need not be asked, by the number of the forces' jumps."""
    return 0 if jumps else PATIENCE


def remember(share: float, found: float, memo: Any) -> None:
    """Note how hard a step kicked, and what was suspected."""
    if share == np.inf:
        memo[3], memo[4] = found, 0.0
    elif found < np.inf:
        memo[0], memo[1], memo[2] = share, found, 0.0


def kick(before: Any, end: Any, orbit: Any, tangent: Any, bent: Any, matrix: Any, away: Any) -> float:
    r"""Return how hard a motion is kicked, as a share of the way to other states; infinite where a period cannot tell.

    The motion :math:`x` stands off the orbit :math:`x_*` by :math:`e = x - x_*`, and the map takes it to
    :math:`P(x) = x_* + J e + D` (`end`), with :math:`D` what the tangent :math:`J` leaves out. Where :math:`D` is quadratic,
    the next orbit, beyond which motions go elsewhere, stands where :math:`(1 - J) e = D`: the share is
    :math:`|(1 - J)^{-1} D| / |e|`. `bent`, `matrix` and `away` are scratch.
    """
    largest, farthest = apart(before, end, orbit, tangent, bent, matrix, away)
    return farthest / largest if largest <= LARGE else np.inf


def apart(before: Any, end: Any, orbit: Any, tangent: Any, bent: Any, matrix: Any, away: Any) -> Any:
    r"""Return :math:`|e|` and :math:`|(1 - J)^{-1} D|`, see `kick`."""
    size, largest, farthest = 2 * mode_count(), 0.0, 0.0
    for a in range(size):
        bent[a] = end[a] - orbit[a]
        for b in range(size):
            bent[a] -= tangent[a, b] * (before[b] - orbit[b])
        largest = max(largest, abs(before[a] - orbit[a]))
    correction(tangent, bent, matrix, away)
    for a in range(size):
        farthest = max(farthest, abs(away[a]))
    return largest, farthest


def has_stayed(largest: float, farthest: float, before: float, kicked: float, most: float, room: float) -> bool:
    """Say whether a motion will settle on the orbit that it is near to, from what `apart` says.

    It was `kicked` off it, and up to `most` since; `before` is the share of the way to other states at the look before, for
    what the tangent leaves out may just pass through zero. The least distance on the orbit has `room` on both sides before
    the next kink.
    """
    if not (before < NEAR and largest < LARGE):
        return False
    within = max(largest, SMALL)
    if farthest < CLEAR * within and EXCURSION * largest < room:
        return True
    return largest < max(SMALL, min(kicked, CALMED * most)) and farthest < NEAR * within


def stay(
    motions: Any, memories: Any, latches: Any, orbits: Any, tangents: Any, zc: Any, rooms: Any, decay: int, count: int,
    first: int, common: int, points: int, tones: Any, bases: Any, table: Any, kinks: Any, stage: Any, work: Any,
    block: Any, p: Any, answers: Any,
) -> None:  # fmt: skip
    """Write into `answers` which of some motions, each at its distance, settle on an orbit there: 1, or 0.

    0 is also the answer where that is not clear before the motion has settled. After a first 0 the answers may be 0. `rooms`
    are the distances from the orbits' least distance to the next kink; `decay` is the time of the slowest mode in common
    periods: where that is long, most of it is leapt over between looks, see `leap`.
    """
    leaps = 0 if not are_lanes_enough(memories[0], latches[0]) else max(0, decay * SPANS // (LOOKS * (REST + 1)) - 1)
    if count <= FEW or not are_lanes_enough(memories[0], latches[0]):
        for j in range(count):
            answers[j] = 0
            if not stays_alone(
                motions[j], memories[j].copy(), latches[j].copy(), orbits[j], tangents[j], rooms[j], leaps, first, common,
                points, tones, bases, table, kinks, stage, work, block, at_distance(p, zc[j]),
            ):  # fmt: skip
                return
            answers[j] = 1
        return
    # columns of the lanes are copied for what is called, which else would be compiled a second time
    size = 2 * mode_count()
    start, end, bent, away = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    matrix = np.empty((size, size))
    width = filled(count)
    lanes, other, before = np.empty((size, width)), np.empty((size, width)), np.empty((size, width))
    here, kicked, most, shares = np.empty(width), np.empty(count), np.zeros(count), np.zeros(count)
    for j in range(width):
        here[j] = zc[j if j < count else 0]
        for k in range(size):
            lanes[k, j] = motions[j if j < count else 0, k]
    park(here, count, p)
    for j in range(count):
        answers[j], kicked[j] = 0, off_by(motions[j], orbits[j])
    for _ in range(LOOKS):
        for k in range(size):
            for j in range(width):
                before[k, j] = lanes[k, j]
        lanes_over_common_period(
            lanes, other, here, first, common, points, memories[0], latches[0], tones, bases, table, kinks, stage, work,
            p,
        )  # fmt: skip
        left = 0
        for j in range(count):
            if answers[j] == 1:
                continue
            for k in range(size):
                start[k], end[k] = before[k, j], lanes[k, j]
            largest, farthest = apart(start, end, orbits[j], tangents[j], bent, matrix, away)
            most[j] = max(most[j], largest)
            earlier, shares[j] = shares[j], farthest / max(largest, SMALL)
            if has_stayed(largest, farthest, earlier, kicked[j], most[j], rooms[j]):
                answers[j] = 1
            elif largest > GONE * max(kicked[j], SMALL):
                count = j  # whatever becomes of those after it
                break
            else:
                left += 1
        if left == 0:
            return
        for _ in range(REST):
            lanes_over_common_period(
                lanes, other, here, first, common, points, memories[0], latches[0], tones, bases, table, kinks, stage,
                work, p,
            )  # fmt: skip
        if leaps > 0:
            for j in range(count):
                for k in range(size):
                    start[k], end[k] = before[k, j], lanes[k, j]
                leap(start, end, orbits[j], tangents[j], leaps)
                for k in range(size):
                    lanes[k, j] = end[k]


def stays_alone(
    motion: Any, memory: Any, latched: Any, orbit: Any, tangent: Any, room: float, leaps: int, first: int, common: int,
    points: int, tones: Any, bases: Any, table: Any, kinks: Any, stage: Any, work: Any, block: Any, p: Any,
) -> bool:  # fmt: skip
    """Say whether one motion settles on an orbit, with memory and branches or without; see `stay`."""
    size = 2 * mode_count()
    start, vector, bent, away = np.empty(size), motion.copy(), np.empty(size), np.empty(size)
    matrix, kicked, most, share = np.empty((size, size)), off_by(motion, orbit), 0.0, 0.0
    for _ in range(LOOKS):
        for k in range(size):
            start[k] = vector[k]
        y = over_common_period(
            from_vector(vector), memory, latched, first, common, points, tones, bases, table, kinks, stage, work, block,
            p,
        )  # fmt: skip
        for k in range(size):
            vector[k] = y[k]
        largest, farthest = apart(start, vector, orbit, tangent, bent, matrix, away)
        most = max(most, largest)
        earlier, share = share, farthest / max(largest, SMALL)
        if has_stayed(largest, farthest, earlier, kicked, most, room):
            return True
        if are_lanes_enough(memory, latched) and largest > GONE * max(kicked, SMALL):  # memory may be kicked, too
            return False
        for _ in range(REST):
            y = over_common_period(
                y, memory, latched, first, common, points, tones, bases, table, kinks, stage, work, block, p
            )
        for k in range(size):
            vector[k] = y[k]
        if leaps > 0:
            leap(start, vector, orbit, tangent, leaps)
    return False


def off_by(motion: Any, orbit: Any) -> float:
    """Return how far a motion is off an orbit: the largest difference."""
    farthest = 0.0
    for k in range(2 * mode_count()):
        farthest = max(farthest, abs(motion[k] - orbit[k]))
    return farthest


def leap(before: Any, motion: Any, orbit: Any, tangent: Any, leaps: int) -> None:
    r"""Take a motion on by some times the REST + 1 periods that lead to it from where it was `before`.

    Its way off the orbit goes on as :math:`e \\to J^{R + 1} e + D`, with the same :math:`D` as over these periods: exact for
    the linear part of the map, and :math:`D` changes little where damping is so weak that leaps are needed.
    """
    size = 2 * mode_count()
    bent, off = np.empty(size), np.empty(size)
    for a in range(size):
        bent[a], off[a] = orbit[a] - before[a], motion[a] - orbit[a]
    through(tangent, bent)
    for a in range(size):
        bent[a] += off[a]
    for _ in range(leaps):
        through(tangent, off)
        for a in range(size):
            off[a] += bent[a]
    for a in range(size):
        motion[a] = orbit[a] + off[a]


def through(tangent: Any, off: Any) -> None:
    """Take what is off an orbit through REST + 1 periods of the linear part of the map."""
    size = 2 * mode_count()
    then = np.empty(size)
    for _ in range(REST + 1):
        for a in range(size):
            then[a] = 0.0
            for b in range(size):
                then[a] += tangent[a, b] * off[b]
        for a in range(size):
            off[a] = then[a]
