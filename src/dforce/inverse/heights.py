"""The heights of a curve: which points are of the approach and which of the retract, and in which order."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dforce.core import units
from dforce.core.arrays import Array, Indices, Texts
from dforce.core.errors import ResultError
from dforce.inverse.table import APPROACH, PAUSE, RETRACT, MeasuredTable
from dforce.inverse.words import naming

TOLERANCE = 3.0  # times the noise of the sensor: a smaller step back does not count
MOST_NOISE = 0.25  # of the range of heights: heights that scatter by more within the tolerance are no walk
MAD = 1.4826  # from the median of absolute values to the standard deviation, for normal noise
WAYS = {APPROACH: -1.0, RETRACT: 1.0}  # how the height changes along each


class OrderedRows(NamedTuple):
    """The rows of a table in the order of the walk, the direction of each, and sentences on how that was known."""

    rows: Indices
    directions: Texts
    history: list[str]


def sensor_noise(height: Array) -> float:
    """Return the standard deviation of a sensor's noise, from the second differences: of equal steps nothing is left."""
    if len(height) < 4:
        return 0.0
    second = np.abs(np.diff(height, 2))
    return float(MAD * np.median(second) / np.sqrt(6.0))


def height_error(height: Array, directions: Texts) -> float:
    """Return the noise (m) of heights that repeat or turn back within a direction; 0 where none do.

    A stop at either end is a pause. If heights only repeat, the steps between them come from the sensor's digits.
    """
    found = 0.0
    for word, way in WAYS.items():
        own = height[directions == word]
        moves = np.flatnonzero(np.diff(own))
        if not len(moves):
            continue
        own = own[moves[0] : moves[-1] + 2]
        step = way * np.diff(own)
        if (step <= 0.0).any():
            quantum = float(np.abs(step[step != 0.0]).min()) / np.sqrt(12.0)
            found = max(found, quantum, sensor_noise(own) if (step < 0.0).any() else 0.0)
    return found


def walk_of(
    table: MeasuredTable, height: Array, segments: Texts | None, direction: str | None, name: str
) -> OrderedRows:
    """Return the order and the directions of the rows of a curve.

    Raises
    ------
    ResultError
        Where heights go back and forth within a direction by more than the noise of the sensor.
    """
    every = np.arange(len(height))
    _refuse_disorder(height, name)
    if direction is not None:
        runs = [(every, direction)]
        history = [f"direction: {direction}, as set"]
    elif segments is not None and set(segments) - {PAUSE}:
        runs = [(every[segments == word], str(word)) for word in (APPROACH, RETRACT) if (segments == word).any()]
        history = [f"direction: {' and '.join(word for _, word in runs)}, from the file"]
        paused = int((segments == PAUSE).sum())
        history += [f"left out: {paused} points of a pause"] if paused else []
    else:
        runs = _runs(table, height, name)
        history = [f"direction: {' and '.join(word for _, word in runs)}, by the order of the heights"]
    rows, words = [], []
    for places, word in runs:
        way = _way(table, height, places, word, name)
        if way * WAYS[word] < 0.0:
            places = places[::-1]
            history.append(f"order: the points of the {word} were in reverse order, and are reversed")
        rows.append(places)
        words += [word] * len(places)
    return OrderedRows(np.concatenate(rows), np.array(words), history)


def is_disordered(height: Array) -> bool:
    """Return whether heights scatter from point to point by so much of their range that they are no walk."""
    return len(height) > 0 and TOLERANCE * sensor_noise(height) > MOST_NOISE * float(np.ptp(height))


def _refuse_disorder(height: Array, name: str) -> None:
    """Raise ResultError for heights that are all alike or in no order, which pass for a sensor of as much noise as range."""
    if len(height) > 1 and not np.ptp(height):
        raise ResultError(f"{name} has the same height at every point; choose another column with {naming('height')}")
    if is_disordered(height):
        noise = sensor_noise(height)
        raise ResultError(
            f"{name} has heights in no order: from point to point they scatter by {units.show(noise, 'm', 2)} within a range "
            f"of {units.show(float(np.ptp(height)), 'm', 3)}; sort the points"
        )


def _turns(height: Array) -> list[int]:
    """Return the rows at which the heights turn, by more than the noise; the last is counted."""
    tolerance = TOLERANCE * sensor_noise(height)
    turns: list[int] = []
    way, extreme = 0.0, 0
    for row in range(1, len(height)):
        step = height[row] - height[extreme]
        if way == 0.0:
            if abs(step) > tolerance:
                way, extreme = np.sign(step), row
        elif step * way >= 0.0:
            extreme = row
        elif abs(step) > tolerance:
            turns.append(extreme)
            way, extreme = -way, row
    return turns


def _runs(table: MeasuredTable, height: Array, name: str) -> list[tuple[Indices, str]]:
    """Return the parts of a curve that names no directions: down, up, or down and then up."""
    turns = _turns(height)
    every = np.arange(len(height))
    if not turns:
        return [(every, RETRACT if height[-1] > height[0] else APPROACH)]
    if len(turns) > 1:
        raise ResultError(
            f"{name} has heights that go back and forth: they turn at {table.place(turns[0])} and at "
            f"{table.place(turns[1])}; sort the points, or add a column 'direction' for approach "
            "and retract"
        )
    if height[turns[0]] > height[0]:
        raise ResultError(
            f"{name} has heights that rise until {table.place(turns[0])} and then fall, as if it started at the "
            "sample. Write height_grows = 'toward' if larger numbers are nearer to it, or add a column 'direction'"
        )
    return [(every[: turns[0] + 1], APPROACH), (every[turns[0] + 1 :], RETRACT)]


def _way(table: MeasuredTable, height: Array, places: Indices, word: str, name: str) -> float:
    """Return 1 for rows whose heights rise, -1 where they fall."""
    own = height[places]
    turns = _turns(own)
    if turns:
        raise ResultError(
            f"{name} has heights of the {word} that turn at {table.place(int(places[turns[0]]))}, at "
            f"{units.show(float(own[turns[0]]), 'm', 6)}, by more than {TOLERANCE:g} times the noise of the sensor; "
            "sort the points"
        )
    return 1.0 if own[-1] >= own[0] else -1.0
