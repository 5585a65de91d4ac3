"""The starts of a fit: the fold of a curve makes false minima, so one start is not enough.

First the region around the user's start is searched. Curves of many cases are followed side by side, and each is shifted along
the heights to its best fit, which needs no other curve. The best different curves are refined, roughly first.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator

import numpy as np

from dforce.core.arrays import Array
from dforce.inverse.fitting.curves import BranchPoints, ModelBranches, difference
from dforce.inverse.fitting.folds import lowest
from dforce.inverse.fitting.minimize import ROUGH, Minimum, Objective
from dforce.inverse.fitting.model import CurveModel, allowed
from dforce.inverse.fitting.points import BEHIND_JUMP, FROM_FREE, MeasuredPoints
from dforce.inverse.fitting.unknowns import CASE, HEIGHT, PHASE, Unknown, limits, start_vector

REACH = np.log(8.0)  # how far around the start logarithms are searched
WIDE = 0.25  # the same for unknowns that are not varied by their logarithm, of their size
CURVES = {0: 1, 1: 16, 2: 32}  # curves to search with, by the number of parameters; more of these: MOST_CURVES
MOST_CURVES, WITH_MEMORY = 64, 12
POINTS = 30  # of a branch that is searched with
ABREAST = 16  # curves that are followed at once along the second branch
ASTRAY = 0.1, 1e-9  # of the free amplitude, and m: how far the heights may be off
SHIFTS = 81
REFINED, MOST_ROUGH = 3, 20  # starts that are refined, and evaluations of each, roughly
DIFFERENT = 0.35  # of REACH: starts nearer to each other are one
CLOSE = 25.0  # of chi2: minima that are roughly found farther above the best are not refined again
ALIKE = 0.3  # of chi2, and of the standard deviation between two curves: within both they are one minimum
LOWEST = 0.25  # share of the points with the least amplitudes, whose height is about their amplitude
SHALLOW = 0.9  # of the free amplitude: if the least amplitudes are larger, their heights do not show the offset
ONSETS = 60  # heights that are tried as the first contact


def first_guess(data: MeasuredPoints, unknowns: list[Unknown], given: set[str], share: float) -> Array:
    """Return the varied numbers at the start, with the free amplitude and the heights from the data.

    On a stiff sample the average distance is about the amplitude of the tip, which is `share` times the reading. So the least
    amplitudes show the offset of the heights. If the amplitude hardly falls, the first contact does.
    """
    varied = start_vector(unknowns)
    for i, one in enumerate(unknowns):
        if one.name in given or one.prior is not None:
            continue
        if one.kind == CASE and one.path.endswith("A0"):
            measured = _free_amplitude(data, one.tone)
            if 0.8 * one.start < measured < 1.25 * one.start and one.low < measured < one.high:
                varied[i] = one.varied(measured)
        elif one.kind == HEIGHT:
            used = np.flatnonzero(data.used)
            low = used[np.argsort(data.amplitude[used, 0])[: max(3, int(LOWEST * len(used)))]]
            guess = float(np.median(share * data.amplitude[low, 0] - data.height[low]))
            if is_shallow(data):
                guess = share * _free_amplitude(data, 0) - _onset(data)
            size = one.scale  # the free amplitude
            if abs(guess - one.start) > 2.0 * max(ASTRAY[0] * size, ASTRAY[1]):
                varied[i] = one.varied(guess)
    return varied


def is_shallow(data: MeasuredPoints) -> bool:
    """Return whether the amplitude nowhere falls far below the free amplitude."""
    amplitude = np.sort(data.amplitude[data.used, 0])
    return bool(np.median(amplitude[: max(3, int(LOWEST * len(amplitude)))]) > SHALLOW * _free_amplitude(data, 0))


def _free_amplitude(data: MeasuredPoints, tone: int) -> float:
    far = np.argsort(-data.height)[:5]
    return float(data.attrs.get("free_amplitude", np.median(data.amplitude[far, tone])))


def _onset(data: MeasuredPoints) -> float:
    """Return the height of the first contact: farther away the curve is flat, nearer it is best a parabola."""
    height, values = data.height[data.used], data.values[data.used]
    values = difference(values, values[np.argmax(height)]) / data.sigma
    left, size = [], _free_amplitude(data, 0)
    tried = np.linspace(height.max(), height.min(), ONSETS, endpoint=False)[1:]
    for onset in tried:
        nearer = np.maximum(onset - height, 0.0) / size
        columns = np.stack([np.ones_like(height), nearer, nearer**2], axis=1)
        left.append(((values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]) ** 2).sum())
    return float(tried[np.argmin(left)])


def searched(model: CurveModel, varied: Array) -> list[Minimum]:
    """Return starts near a first guess, the best first; the guess itself is searched, too."""
    from scipy.stats import qmc

    unknowns = model.unknowns
    wide = [
        i
        for i, one in enumerate(unknowns)
        if one.kind == CASE and one.prior is None and not one.path.startswith(("drive.", "cantilever."))
    ]
    count = CURVES.get(len(wide), MOST_CURVES) if model.curves.is_smooth else WITH_MEMORY
    many = np.tile(varied, (count, 1))
    size = np.array([REACH if unknowns[i].is_log else WIDE for i in wide])
    if wide:
        sobol = qmc.Sobol(len(wide), scramble=True, seed=np.random.default_rng(1))  # SciPy before 1.15 has no `rng`
        many[1:, wide] += size * (2.0 * sobol.random(count)[1:] - 1.0)
    low, high = limits(unknowns)
    many = np.clip(many, low, high)
    many = many[[allowed(model, row) for row in many]]
    if not len(many):
        return [Minimum(varied, np.inf)]
    starts: list[Minimum] = []
    chosen: list[Minimum] = []
    for more, floor in _shifted(model, many):
        starts = sorted(starts + more, key=lambda one: one.chi2)
        chosen = []
        for start in starts:
            if all(np.abs((start.varied - other.varied)[wide] / size).max() > DIFFERENT for other in chosen):
                chosen.append(start)
            if len(chosen) == REFINED or not wide:
                break
        if len(chosen) == REFINED and chosen[-1].chi2 <= floor:
            break
    return chosen


def _shifted(model: CurveModel, many: Array) -> Iterator[tuple[list[Minimum], float]]:
    """Give many places with the heights, and the phase, at their best fit; and a lower bound of chi2 for all later places.

    All are followed along the first branch. Its chi2 is a lower bound for both branches, so the best are followed first.
    """
    data, unknowns, size = model.data, model.unknowns, model.case.problem.tones[0].A0
    heights = [i for i, one in enumerate(unknowns) if one.kind == HEIGHT]
    turns = [i for i, one in enumerate(unknowns) if one.kind == PHASE and one.tone == 0 and one.prior is None]
    reach = max(ASTRAY[0] * size, ASTRAY[1]) if heights else 0.0
    shifts = np.linspace(-reach, reach, SHIFTS) if heights else np.zeros(1)
    parts = [_evenly(model, stretch, reach) for stretch in model.stretches]
    first, phase = _apart(parts[0], many, shifts), data.tones
    turned = first.copy()
    if turns and first.shape[2]:
        turned[..., phase] -= turned[..., phase].mean(axis=2, keepdims=True)
    least = _chi2(turned, data).min(axis=1)
    order = np.argsort(least, kind="stable")
    for begun in range(0, len(order), ABREAST):
        some, later = order[begun : begun + ABREAST], order[begun + ABREAST :]
        apart = np.concatenate([first[some], *(_apart(part, many[some], shifts) for part in parts[1:])], axis=2)
        turn = -np.median(apart[..., phase], axis=2) if turns else np.zeros(apart.shape[:2])
        apart[..., phase] += turn[..., None]
        chi2, out = _chi2(apart, data), []
        for i, best in enumerate(np.argmin(chi2, axis=1)):
            varied = many[some[i]].copy()
            for k in heights:
                varied[k] += shifts[best] / unknowns[k].scale
            for k in turns:
                varied[k] += turn[i, best]
            out.append(Minimum(varied, float(chi2[i, best])))
        yield out, float(least[later].min(initial=np.inf))


def _evenly(model: CurveModel, stretch: BranchPoints, reach: float) -> CurveModel:
    """Return a model along evenly spaced heights that reach beyond the measured ones of one branch."""
    low, high = float(stretch.heights.min()) - reach, float(stretch.heights.max()) + reach
    along = np.linspace(high, low, POINTS) if stretch.kind == FROM_FREE else np.linspace(low, high, POINTS)
    # nearer by so much the amplitude is less by about as much
    amplitude = np.maximum(stretch.amplitude - reach * (stretch.kind == BEHIND_JUMP), 0.1 * stretch.amplitude)
    other = copy.copy(model)
    other.stretches = [BranchPoints(stretch.kind, np.arange(POINTS), along, amplitude, stretch.phase)]
    other.curves = ModelBranches(
        model.case.problem, other.stretches, model.case.solver, model.data.tones, model.finer, model.check_cancelled
    )
    return other


def _apart(part: CurveModel, many: Array, shifts: Array) -> Array:
    """Return how far curves at each of some shifts are from some of the points, (curves, shifts, points, 2 tones)."""
    data, stretch = part.data, part.stretches[0]
    used = np.flatnonzero(data.used)
    thin = used[:: max(1, len(used) // (2 * POINTS))]
    mine = thin[(data.branch[thin] == BEHIND_JUMP) == (stretch.kind == BEHIND_JUMP)]
    order, at = np.argsort(stretch.heights), data.height[mine] + shifts[:, None]
    along = stretch.heights[order]
    curves = [predicted.values[order].T for predicted in part.predict_many(many)]
    values = [np.stack([np.interp(at, along, column) for column in curve], axis=-1) for curve in curves]
    return difference(np.array(values), data.values[mine])


def _chi2(apart: Array, data: MeasuredPoints) -> Array:
    """Return the sums of squared differences between curves and points, (curves, shifts)."""
    return np.asarray(((apart / data.sigma) ** 2).sum(axis=(2, 3)))


def refined(model: CurveModel, starts: list[Minimum], on_run: Callable[[Objective], None]) -> list[Minimum]:
    """Return the different minima that starts lead to, the lowest first."""
    far: list[Minimum] = []
    if len(starts) > 1:
        rough = CurveModel(
            model.case,
            model.unknowns,
            model.data,
            model.finer,
            np.arange(0, len(model.points), 3),
            model.check_cancelled,
        )
        for points in (rough, model):
            minima = [Objective(points, start.varied, on_run=on_run).minimize(ROUGH, MOST_ROUGH) for start in starts]
            found = different(minima, points)
            starts = [one for one in found if one.chi2 < found[0].chi2 + CLOSE]
        far = found[len(starts) :]
    return different([*(lowest(Objective(model, start.varied, on_run=on_run)) for start in starts), *far], model)


def different(minima: list[Minimum], model: CurveModel) -> list[Minimum]:
    """Return minima in order, each only once: minima with equal curves, within the noise, are one."""
    out: list[Minimum] = []
    for one in sorted(minima, key=_rank):
        if not any(_same(one, other, model) for other in out):
            out.append(one)
    return out


def _rank(one: Minimum) -> float:
    """Return chi2 for the order of minima: each point has a measured state, so a minimum that loses points comes later."""
    return one.chi2 + (CLOSE if one.lost else 0.0)


def _same(one: Minimum, other: Minimum, model: CurveModel) -> bool:
    if one.prediction is None or other.prediction is None:
        return one.prediction is other.prediction
    apart = difference(one.prediction.values, other.prediction.values) / model.sigma
    return bool(abs(one.chi2 - other.chi2) < ALIKE and np.sqrt((apart**2).mean()) < ALIKE)
