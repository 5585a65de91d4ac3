"""Periodic orbits of many problems side by side, each followed along its own distances.

The method of ``shooting``, point by point in step: the motions of all cases are marched together, and so are the neighbors
that give their tangents. For problems with one tone and forces without memory and branches that do not depend on the time.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.kernel.slots import of_case
from dforce.observables.measure import D_MIN, measure
from dforce.solvers.guess import best_order, correction, predict
from dforce.solvers.kicks import MEMO, is_suspect, kick, remember, suspicion
from dforce.solvers.lanes import advance_samples
from dforce.solvers.shooting import (
    CONTRACTS,
    CONVERGED,
    LARGEST,
    LOST,
    SHORTEST,
    UNSTABLE,
    is_stable,
)

NUDGE = 2e-7  # of the free amplitude: distance of the neighbors; one side is enough this near
NEAR_ENOUGH = 1e-5  # of the free amplitude: a tangent so near to the orbit is its own
WIDTH = 4  # lanes are filled up to a multiple of this: the width of a vector register
MARCHING, DONE, GONE = 0, 1, 2  # what a case is doing at a distance


def padded(count: int) -> int:
    """Return the number of lanes that hold so many motions."""
    return WIDTH * ((count + WIDTH - 1) // WIDTH)


def block_of(room: Any, points: int, size: int, count: int) -> Any:
    """Return a block for the samples of so many motions over a period, made of the room given."""
    lanes = padded(count)
    return room[: (points + 1) * (size + 1) * lanes].reshape((points + 1, size + 1, lanes))


def pack(
    which: Any, count: int, each: int, motions: Any, here: Any, parameters: Any, kinks: Any, drive: Any, block: Any,
    lane_parameters: Any, lane_kinks: Any, lane_drive: Any, case_of: Any,
) -> None:  # fmt: skip
    """Fill lanes with `count` cases, `each` lanes a case: the motion itself, or its neighbors where there are several.

    `here` is each case's distance. Lanes left over repeat the first case.
    """
    size = motions.shape[1]
    for j in range(block.shape[2]):
        case = which[j // each] if j < count * each else which[0]
        case_of[j] = case
        for k in range(parameters.shape[0]):
            lane_parameters[k, j] = parameters[k, case]
        lane_parameters[0, j] = here[case]
        for k in range(kinks.shape[0]):
            lane_kinks[k, j] = kinks[k, case]
        for k in range(drive.shape[0]):
            lane_drive[k, j] = drive[k, case]
        for k in range(size):
            block[0, k, j] = motions[case, k] + (NUDGE if each > 1 and j % each == k else 0.0)


def march_lanes(
    which: Any, count: int, each: int, motions: Any, here: Any, parameters: Any, kinks: Any, drive: Any, tones: Any,
    bases: Any, points: int, cosine: Any, nothing: Any, work: Any, block: Any, p: Any,
) -> int:  # fmt: skip
    """Advance cases by one period; return the row of the block at its end."""
    lanes = block.shape[2]
    lane_parameters = np.empty((parameters.shape[0], lanes))
    lane_kinks, lane_drive = np.empty((kinks.shape[0], lanes)), np.empty((drive.shape[0], lanes))
    case_of, crossed = np.empty(lanes, np.int64), np.empty(lanes, np.int64)
    pack(
        which, count, each, motions, here, parameters, kinks, drive, block, lane_parameters, lane_kinks, lane_drive,
        case_of,
    )  # fmt: skip
    return advance_samples(
        block, lane_parameters, lane_drive, lane_kinks, tones, case_of, bases, points, cosine, crossed, nothing, work, p
    )


def take_tangents(
    which: Any, count: int, motions: Any, ends: Any, here: Any, parameters: Any, kinks: Any, drive: Any, tones: Any,
    bases: Any, points: int, cosine: Any, nothing: Any, work: Any, p: Any, jacobians: Any,
) -> None:  # fmt: skip
    """Write the derivative of the map at the motions of some cases, which lead to `ends`."""
    size = motions.shape[1]
    block = np.empty((2, size + 1, padded(count * size)))
    end = march_lanes(
        which, count, size, motions, here, parameters, kinks, drive, tones, bases, points, cosine, nothing, work, block,
        p,
    )  # fmt: skip
    for j in range(count):
        case = which[j]
        for k in range(size):
            for i in range(size):
                jacobians[case, i, k] = (block[end, i, j * size + k] - ends[case, i]) / NUDGE


def predict_tangent(jacobians: Any, zc: Any, i: int, out: Any) -> None:
    """Write a guess of the tangent at distance i: the line through those at the two distances before it."""
    weight = (zc[i] - zc[i - 1]) / (zc[i - 1] - zc[i - 2]) if i > 1 else 0.0
    for a in range(out.shape[0]):
        for b in range(out.shape[1]):
            out[a, b] = jacobians[i - 1, a, b]
            if i > 1:
                out[a, b] += weight * (jacobians[i - 1, a, b] - jacobians[i - 2, a, b])


def take_slopes(
    which: Any, count: int, motions: Any, here: Any, parameters: Any, kinks: Any, drive: Any, tones: Any, bases: Any,
    points: int, cosine: Any, nothing: Any, work: Any, p: Any, tangents: Any, slopes: Any,
) -> None:  # fmt: skip
    """Write how the orbits of some cases change with the distance (per meter), for the first step along it."""
    size = motions.shape[1]
    change, matrix = np.empty(size), np.empty((size, size))
    block = np.empty((2, size + 1, padded(count)))
    farther = here + NUDGE * parameters[1]
    end = march_lanes(
        which, count, 1, motions, farther, parameters, kinks, drive, tones, bases, points, cosine, nothing, work, block,
        p,
    )  # fmt: skip
    for j in range(count):
        case = which[j]
        for k in range(size):
            change[k] = (block[end, k, j] - motions[case, k]) / (NUDGE * parameters[1, case])
        correction(tangents[case], change, matrix, slopes[case])


def take_kicks(
    which: Any, count: int, i: int, orbits: Any, tangents: Any, rows: Any, zc: Any, done: Any, here: Any, parameters: Any,
    kinks: Any, drive: Any, tones: Any, bases: Any, points: int, cosine: Any, nothing: Any, work: Any, p: Any, infos: Any,
    patience: int, memos: Any,
) -> None:  # fmt: skip
    """Write how hard the step to distance i kicks the motion of each case that was done there, see ``shooting.kick``."""
    size, asked = orbits.shape[2], 0
    suspect, shares, nearest = np.empty(count, np.int64), np.empty(count), np.empty(2)
    bent, away, matrix = np.empty(size), np.empty(size), np.empty((size, size))
    for j in range(count):
        case = which[j]
        if done[case] != i + 1:
            continue
        nearest[0], nearest[1] = rows[case, i - 1, D_MIN], rows[case, i, D_MIN]
        share = suspicion(orbits[case], tangents[case], nearest, zc[case], i, kinks[:, case].copy(), bent, matrix, away)
        if is_suspect(share, patience, memos[case]):
            suspect[asked], shares[asked] = case, share
            asked += 1
    if asked == 0:
        return
    block = np.empty((2, size + 1, padded(asked)))
    end = march_lanes(
        suspect, asked, 1, orbits[:, i - 1], here, parameters, kinks, drive, tones, bases, points, cosine, nothing, work,
        block, p,
    )  # fmt: skip
    for j in range(asked):
        case = suspect[j]
        infos[case, i, 4] = kick(
            orbits[case, i - 1], block[end, :size, j], orbits[case, i], tangents[case, i], bent, matrix, away
        )
        remember(shares[j], infos[case, i, 4], memos[case])


def follow_cases(
    starts: Any, zc: Any, counts: Any, parameters: Any, kinks: Any, drive: Any, tones: Any, bases: Any, points: int,
    cosine: Any, work: Any, p: Any, tolerance: float, most: int, order: int, patience: int, harmonics: int, orbits: Any,
    jacobians: Any, infos: Any, rows: Any, done: Any,
) -> None:  # fmt: skip
    """Follow a stable orbit of each case through its distances `zc`, and measure it at each.

    Each starts from its motion in `starts` and stops before the first distance at which no stable orbit is found, or after
    `counts` of them; `done` gets how many there were. Arrays have the cases first: zc (cases, distances); orbits,
    jacobians, infos and rows like those of ``shooting.follow`` behind the cases. `parameters`, `kinks` and `drive` have
    the cases last, `tones` first; `p` is the tip equation, whose own numbers are not used.
    """
    cases, size = starts.shape
    motions, ends, begun, steps = (
        starts.copy(),
        np.empty((cases, size)),
        np.empty((cases, size)),
        np.empty((cases, size)),
    )
    here, before, shorter = np.empty(cases), np.empty(cases), np.empty(cases)
    state, guessed = np.full(cases, MARCHING), np.zeros(cases, np.int64)  # guessed: whether the tangent is a guess
    moved = np.empty(cases)  # how far since the tangent was taken
    tangents, miss, matrix = np.zeros((cases, size, size)), np.empty(size), np.empty((size, size))
    active, marching, wanting = np.empty(cases, np.int64), np.empty(cases, np.int64), np.empty(cases, np.int64)
    nothing = np.empty(0)
    done[:] = 0
    slopes, memos = np.zeros((cases, size)), np.full((cases, MEMO), np.inf)
    memos[:, 0] = 0.0
    # room for the samples, taken once: fresh memory costs more than what is done with it
    room, record = np.empty((points + 1) * (size + 1) * padded(cases)), np.empty((points + 1, size + 1))
    for i in range(zc.shape[1]):
        count = 0
        for case in range(cases):
            if done[case] == i and i < counts[case]:
                active[count] = case
                count += 1
                here[case], before[case], shorter[case], moved[case] = zc[case, i], np.inf, 1.0, np.inf
                state[case], guessed[case] = MARCHING, 1 if i > 0 else 0
                infos[case, i, 1], infos[case, i, 2], infos[case, i, 3] = 0, LOST, np.inf
                if i > 0:
                    chosen = best_order(orbits[case], zc[case], i, order, miss)
                    predict(orbits[case], zc[case], i, i, chosen, motions[case])
                    predict_tangent(jacobians[case], zc[case], i, tangents[case])
                if i == 1:
                    motions[case] += slopes[case] * (zc[case, 1] - zc[case, 0])
        if count == 0:
            return
        left = count
        marching[:count] = active[:count]
        for attempt in range(most + 1):
            block = block_of(room, points, size, left)
            march_lanes(
                marching, left, 1, motions, here, parameters, kinks, drive, tones, bases, points, cosine, nothing, work,
                block, p,
            )  # fmt: skip
            wanted, going = 0, 0
            for j in range(left):
                case = marching[j]
                worst = 0.0
                for k in range(size):
                    ends[case, k] = block[points, k, j]
                    worst = max(worst, abs(ends[case, k] - motions[case, k]))
                infos[case, i, 0], infos[case, i, 1] = worst, attempt
                if worst < tolerance:
                    state[case] = DONE
                    for sample in range(points + 1):
                        for k in range(size + 1):
                            record[sample, k] = block[sample, k, j]
                    one = of_case(p, parameters, case, here[case])
                    measure(record, 0, points, tones[case], bases, one, kinks[:, case].copy(), harmonics, rows[case, i])
                elif attempt == most or not worst < np.inf:
                    state[case] = GONE
                else:
                    marching[going] = case
                    going += 1
                if state[case] == GONE:
                    continue
                too_far = worst > before[case] and shorter[case] > SHORTEST
                slow = (guessed[case] == 0 and moved[case] == np.inf) or (
                    worst > CONTRACTS * before[case] and not too_far
                )
                if (state[case] == DONE and moved[case] > NEAR_ENOUGH) or (state[case] == MARCHING and slow):
                    wanting[wanted] = case
                    wanted += 1
                    moved[case] = 0.0
                    infos[case, i, 3] = worst
            if wanted > 0:
                take_tangents(
                    wanting, wanted, motions, ends, here, parameters, kinks, drive, tones, bases, points, cosine, nothing,
                    work, p, tangents,
                )  # fmt: skip
            left = going
            if left == 0:
                break
            for j in range(left):
                case = marching[j]
                worst = infos[case, i, 0]
                if worst > before[case] and shorter[case] > SHORTEST:
                    shorter[case] *= 0.25  # the correction went too far: take less of it, from where it started
                else:
                    before[case] = worst
                    for k in range(size):
                        miss[k] = ends[case, k] - motions[case, k]
                        begun[case, k] = motions[case, k]
                    correction(tangents[case], miss, matrix, steps[case])
                    longest = np.max(np.abs(steps[case]))
                    shorter[case] = min(1.0, LARGEST / longest) if longest > 0.0 else 1.0
                for k in range(size):
                    motions[case, k] = begun[case, k] + shorter[case] * steps[case, k]
                    moved[case] = max(moved[case], shorter[case] * abs(steps[case, k]))
        for j in range(count):
            case = active[j]
            if state[case] != DONE:
                continue
            if not is_stable(tangents[case]):
                infos[case, i, 2] = UNSTABLE
                continue
            infos[case, i, 2] = CONVERGED
            orbits[case, i], jacobians[case, i] = motions[case], tangents[case]
            done[case] = i + 1
        if i > 0:
            take_kicks(
                active, count, i, orbits, jacobians, rows, zc, done, here, parameters, kinks, drive, tones, bases, points,
                cosine, nothing, work, p, infos, patience, memos,
            )  # fmt: skip
        if i == 0 and zc.shape[1] > 1:
            take_slopes(
                active, count, motions, here, parameters, kinks, drive, tones, bases, points, cosine, nothing, work, p,
                tangents, slopes,
            )  # fmt: skip
