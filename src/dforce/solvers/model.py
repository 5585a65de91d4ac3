"""The tip equations of a block of problems, as the compiled solvers take them: at each value of a parameter.

The parameter is the average distance or the frequency of the first tone.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from dforce.kernel.codegen import FIRST_MODE, OMEGA, PER_MODE, SPEED, ZC
from dforce.kernel.linker import uncounted
from dforce.kernel.vocabulary import fluid_size, mode_count
from dforce.solvers.retune import retune

DISTANCE, FREQUENCY = 0, 1  # the parameter that is varied


class Model(NamedTuple):
    """The tip equations of a block of problems.

    Attributes
    ----------
    numbers, kinks
        The kernel's parameters and the distances (m) where a force is not smooth, one column a problem.
    tones
        The kernel's tone tables, (problems, tones, columns).
    responses
        Coefficients that take the tones to other frequencies, (problems, tones, numbers).
    parameter
        The varied parameter: DISTANCE (m) or FREQUENCY (Hz) of the first tone.
    unit
        The parameter's unit of each problem: the free amplitude (m), or the width of the resonance (Hz).
    reference
        Frequency (Hz) at which the numbers hold.
    lever
        Number of the lever of each problem, (problems,).
    heights, levers, drives
        Distances (m) at which levers are known that change with their height, (levers, heights), the first numbers of the
        parameters and the tone tables there, a row for each distance; there is none where levers stay.
    memory_scale
        Scale of each number of the forces' memory.
    gain
        How far from rest each number of the memory is, by its rate alone, in changes over a common period, (problems, states).
    elements
        Where the memory of each element of the sample begins, and the end of the last, (elements + 1,).
    hysteresis
        Number of forces with two branches.
    tip
        The tip equation of one problem, for the addresses of the compiled functions in it.
    """

    numbers: Any
    kinks: Any
    tones: Any
    responses: Any
    parameter: int
    unit: Any
    reference: Any
    lever: Any
    heights: Any
    levers: Any
    drives: Any
    memory_scale: Any
    gain: Any
    elements: Any
    hysteresis: int
    tip: Any


class SharedDrive(NamedTuple):
    """The drive that all problems of a block share.

    Attributes
    ----------
    phases
        Phase of each tone at the start of each period of a common period, (periods, tones).
    waves
        Its cosine and minus its sine at the ends and middles of all steps, (periods, 2 tones, 2 points + 1).
    turns
        Turns of the tones, with which deflection and force are measured.
    points, periods
        Steps of a period of the first tone; its periods in a common period.
    """

    phases: Any
    waves: Any
    turns: Any
    points: int
    periods: int


def place_column(model: Any, case: int, value: float, numbers: Any, kinks: Any, tones: Any, j: int) -> None:
    """Write the numbers, kinks and tones of a problem at a value of the parameter into column j."""
    for k in range(numbers.shape[0]):
        numbers[k, j] = model.numbers[k, case]
    for k in range(kinks.shape[0]):
        kinks[k, j] = model.kinks[k, case]
    ratio = 1.0
    if model.parameter == DISTANCE:
        numbers[ZC, j] = value
    else:  # times are scaled by the first tone's frequency
        ratio = value / model.reference[case]
        numbers[SPEED, j] *= ratio
        numbers[OMEGA, j] *= ratio
        for n in range(mode_count()):
            first = FIRST_MODE + PER_MODE * n
            numbers[first, j] /= ratio * ratio
            numbers[first + 1, j] /= ratio
            numbers[first + 2, j] /= ratio * ratio
        for k in range(2 * fluid_size()):
            numbers[FIRST_MODE + PER_MODE * mode_count() + k, j] /= ratio
    lever = model.lever[case]
    place, share = between(model.heights[lever], value)
    if place >= 0:
        for k in range(model.levers.shape[2]):
            low, high = model.levers[lever, place, k], model.levers[lever, place + 1, k]
            numbers[FIRST_MODE + k, j] = (1.0 - share) * low + share * high
    for k in range(tones.shape[1]):
        for n in range(tones.shape[2]):
            tones[j, k, n] = model.tones[case, k, n]
            if place >= 0:
                low, high = model.drives[lever, place, k, n], model.drives[lever, place + 1, k, n]
                tones[j, k, n] = (1.0 - share) * low + share * high
        if model.parameter == FREQUENCY:
            retune(tones[j, k], model.responses[case, k], mode_count(), ratio)


@uncounted
def between(heights: Any, value: float) -> Any:
    """Return the number of the interval of heights that a distance is in, and how far (0 to 1); -1 where there are none."""
    last = heights.shape[0] - 2
    if last < 0:
        return -1, 0.0
    place, after = 0, last + 1
    while after - place > 1:
        middle = (place + after) // 2
        if heights[middle] <= value:
            place = middle
        else:
            after = middle
    share = (value - heights[place]) / (heights[place + 1] - heights[place])
    return place, min(max(share, 0.0), 1.0)
