"""The tip equations of a block of problems, as the compiled solvers take them: at each value of a parameter.

The parameter is the average distance or the frequency of the first tone.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from dforce.kernel.codegen import FIRST_DRIVE, FIRST_MODE, OMEGA, PER_MODE, SPEED, ZC
from dforce.kernel.linker import uncounted
from dforce.kernel.vocabulary import fluid_size, mode_count

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
        Distances (m) in the tables of levers that change with their height, (levers, heights), and the first numbers of the
        parameters and the tone tables there, a row for each distance. None for constant levers.
    memory_scale
        Scale of each number of the forces' memory.
    gain
        Distance from rest of each number of the memory, by its rate alone, in changes over a common period, (problems, states).
    elements
        The first place in the memory of each element of the sample, and the end of the last, (elements + 1,).
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


class Marching(NamedTuple):
    """Tip equations of the problems whose motions march, the drive that they share, and scratch.

    Attributes
    ----------
    model, drive
        See there.
    room
        Scratch for the samples, at least (points + 1) (size + 1) lanes long.
    """

    model: Any
    drive: Any
    room: Any


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


def retune(tone: Any, response: Any, modes: int, g: float) -> None:
    """Change the row of a tone table to g times its frequency; `response` is the tone's row of ``kernel.responses``.

    A driving force keeps its size, and the base moves by the piezo's response at the new frequency. In time scaled by this
    frequency, a force drives a mode by 1/g^2 of its earlier value. A base motion Y drives it by
    (c0 + i c1 D / g + c2 / g^2) Y: the parts of inertia, drag and spring, with D from `drag_of`.
    """
    if response.shape[0] == 0:
        for n in range(2 * modes):
            tone[FIRST_DRIVE + n] /= g * g
        return
    place, w, damping = FIRST_DRIVE + 2 * modes, response[3 * modes], response[3 * modes + 1]
    # the piezo's response over that at the frequency before
    above_real, above_imaginary = 1.0 - w * w, w / damping
    below_real, below_imaginary = 1.0 - w * w * g * g, w * g / damping
    size = below_real * below_real + below_imaginary * below_imaginary
    real = (above_real * below_real + above_imaginary * below_imaginary) / size
    imaginary = (above_imaginary * below_real - above_real * below_imaginary) / size
    base_real = tone[place] * real - tone[place + 1] * imaginary
    base_imaginary = tone[place] * imaginary + tone[place + 1] * real
    tone[place], tone[place + 1] = base_real, base_imaginary
    for n in range(modes):
        with_cosine = response[n] + response[2 * modes + n] / (g * g)
        at_once, late = drag_of(response, modes, n, g)
        with_cosine -= response[modes + n] / g * late
        with_sine = response[modes + n] / g * at_once
        tone[FIRST_DRIVE + n] = with_cosine * base_real - with_sine * base_imaginary
        tone[FIRST_DRIVE + modes + n] = with_cosine * base_imaginary + with_sine * base_real


def drag_of(response: Any, modes: int, n: int, g: float) -> Any:
    r"""Return a mode's drag at g times the frequency, real and imaginary part, relative to fluid without memory.

    .. math:: 1 - \sum_j \frac{w_j s_j}{s_j + i g}

    with rates and shares of its fluid's memory, behind the other numbers of the row; without memory it is 1.
    """
    count = (response.shape[0] - 3 * modes - 2) // (2 * modes)
    first = 3 * modes + 2 + 2 * count * n
    at_once, late = 1.0, 0.0
    for k in range(count):
        rate, share = response[first + k], response[first + count + k]
        at_once -= share * rate * rate / (rate * rate + g * g)
        late += share * rate * g / (rate * rate + g * g)
    return at_once, late
