"""The free part of a curve: the farthest stretch along which nothing changes, and the noise in it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from dforce.core.arrays import Array, Bools

LEAST_POINTS, LEAST_SHARE = 10, 0.05  # of a curve
WIDE = 3.0  # errors by which a point of the free part may be off its median
FLAT = 2.0  # errors by which a slope may differ from zero
STRAY = 100  # of so many points one may be farther off than that
SIZES = 300  # stretches that are tried
SPIKE = 8.0  # times the scatter of the others: a point so far off is a spike
DIGITS = 1.5  # last digits of the values: a point nearer to the others is neither far off nor a spike
LAST = 2  # points of a stretch: where one of them is far off, no spike but a force begins
LONGER = 1.5  # times a stretch without a slope: a straight line so long is a drift
TAIL = 0.25  # curvature over slope, both in units of their errors, of a force that falls by e**2 along a stretch
MARGIN = 0.1  # of a stretch is left out at its near end, where a change may be too small to be seen


Test = Callable[[Array, Array, float], bool]  # of heights, values, and their allowed change


class FreeChannel(NamedTuple):
    """A channel along the free part.

    Attributes
    ----------
    mean, error
        Mean and its standard error, neighbors' correlation included.
    noise
        Standard deviation of a point, drift not counted.
    correlation
        Of neighbors, once the slope is taken out.
    slope, slope_error
        By height.
    points
        How many.
    """

    mean: float
    error: float
    noise: float
    correlation: float
    slope: float
    slope_error: float
    points: int


def line_of(height: Array, values: Array) -> tuple[float, float, Array]:
    """Return slope, the spread of the heights about their mean, and the residuals of a straight line."""
    x = height - height.mean()
    spread = float(np.sqrt((x**2).sum()))
    slope = float((x * values).sum() / spread**2) if spread > 0.0 else 0.0
    return slope, spread, values - values.mean() - slope * x


def digit(values: Array) -> float:
    """Return the smallest difference of values: their last digit where it is coarse, far below the noise elsewhere."""
    return float(np.diff(np.unique(values)).min()) if np.ptp(values) > 0.0 else 0.0


def stretch(height: Array, values: Array) -> FreeChannel:
    """Return mean, slope and noise of a channel along a stretch of three points or more."""
    count = len(values)
    slope, spread, rest = line_of(height, values)
    power = float((rest**2).sum())
    correlation = float((rest[1:] * rest[:-1]).sum() / power) if power > 0.0 else 0.0
    noise, last = float(np.sqrt((np.diff(values) ** 2).mean() / 2.0)), digit(values)
    rounding = last / np.sqrt(12.0) if noise < 0.5 * last else 0.0  # no mean takes it away
    noise = max(noise, rounding)
    known = correlation if correlation > FLAT / np.sqrt(count) else 0.0
    known = min(known, 0.95)
    noise /= np.sqrt(1.0 - known)
    longer = np.sqrt((1.0 + known) / (1.0 - known))
    slope_error = noise * longer / spread if spread > 0.0 else 0.0
    return FreeChannel(
        float(values.mean()),
        max(noise * longer / np.sqrt(count), rounding),
        noise,
        correlation,
        slope,
        slope_error,
        count,
    )


def steady(values: Array) -> Bools:
    """Return which points of a stretch are no spikes: few points, much farther off the median than all others scatter.

    The last points do not count among these others: there a force may begin.
    """
    off = np.abs(values - np.median(values))
    others = np.sort(off[:-LAST])[: -1 - len(values) // STRAY]
    usual = np.sqrt((others**2).mean()) if len(others) else 0.0
    return np.asarray((off <= max(SPIKE * usual, DIGITS * digit(values))) | (usual == 0.0))


def steady_stretch(height: Array, values: Array) -> FreeChannel:
    """Return the same along a stretch without its spikes."""
    kept = steady(values)
    return stretch(height[kept], values[kept])


def fewest(points: int) -> int:
    """Return how many points the free part of a curve of so many points has at least."""
    return max(LEAST_POINTS, int(np.ceil(LEAST_SHARE * points)))


def free_count(
    height: Array, channels: Iterable[Array], allowed: Iterable[float], drifting: Iterable[bool]
) -> tuple[int, bool]:
    """Return the number of free points, from the far end on, and whether a channel drifts along them.

    It is the longest stretch in which no channel has a slope, or a point off its median beyond the noise, except spikes.
    Without one it is the longest stretch that a straight line describes. So it is with a far shorter one, for noise hides a
    short piece of a drift, if channels other than `drifting` have no slope. Nothing is free where the count is 0.

    Parameters
    ----------
    height
        From the far end to the near one (m).
    channels
        Amplitude, phase, ... at these heights.
    allowed
        Allowed change of each along a stretch.
    drifting
        Whether each changes less by forces far away than by a drift, as amplitudes do.
    """
    least, every = fewest(len(height)), list(zip(channels, allowed, drifting, strict=True))
    if len(height) < least:
        return 0, False
    sizes = np.unique(np.linspace(least, len(height), min(SIZES, len(height) - least + 1)).astype(int))[::-1]

    def longest(beyond: float, amplitude: Test, others: Test) -> int:
        for size in sizes[sizes > beyond]:
            kept = [steady(channel[:size]) for channel, *_ in every]
            if all(
                inner[-LAST:].all()
                and (amplitude if slow else others)(height[:size][inner], channel[:size][inner], most)
                for inner, (channel, most, slow) in zip(kept, every, strict=True)
            ):
                return int(size)
        return 0

    flat = longest(0.0, _is_flat, _is_flat)
    straight = longest(LONGER * flat, _is_straight, _is_flat if flat else _is_straight)
    size = straight or flat
    return max(least, int((1.0 - MARGIN) * size)) if size else 0, straight > 0


def _is_flat(height: Array, values: Array, most: float) -> bool:
    if np.ptp(values) == 0.0:  # the slope of equal values may be one of rounding
        return True
    found = stretch(height, values)
    if abs(found.slope) * float(np.ptp(height)) > most:
        return False
    return abs(found.slope) <= FLAT * found.slope_error and _few_strays(values - np.median(values), values, found.noise)


def _is_straight(height: Array, values: Array, most: float) -> bool:
    """Return whether a stretch is a straight line within its noise: no curvature, no point far off it."""
    found = stretch(height, values)
    rest = line_of(height, values)[2]
    if abs(found.slope) * float(np.ptp(height)) > most:
        return False
    return abs(_curvature(height, rest)) <= FLAT * found.noise and _few_strays(rest, values, found.noise)


def is_drift(height: Array, values: Array) -> bool:
    """Return whether a straight line describes a stretch, and no tail of a force, whose slope grows towards the sample."""
    kept = steady(values)
    height, values = height[kept], values[kept]
    found = stretch(height, values)
    towards = -np.sign(found.slope) * _curvature(height, line_of(height, values)[2])
    steep = abs(found.slope) / found.slope_error if found.slope_error else 0.0
    return bool(towards < (TAIL * steep - FLAT) * found.noise)


def _curvature(height: Array, rest: Array) -> float:
    """Return the part of the residuals of a line that is a parabola of unit length; infinite for fewer than three heights."""
    x = height - height.mean()
    basis = np.stack([np.ones_like(x), x / max(float(np.abs(x).max()), 1e-300)], axis=1)
    square = basis[:, 1] ** 2
    bend = square - basis @ np.linalg.lstsq(basis, square, rcond=None)[0]
    size = float(np.sqrt((bend**2).sum()))
    return float((bend * rest).sum()) / size if size else np.inf


def _few_strays(rest: Array, values: Array, noise: float) -> bool:
    far: Bools = np.abs(rest) > max(WIDE * noise, DIGITS * digit(values))
    return int(far.sum()) <= len(rest) // STRAY
