"""Takes the drive of a tone to another frequency: a force stays what it is, a base goes on moving as its piezo lets it.

g is the new frequency over the one of the numbers. In time scaled by the new frequency a force drives a mode by 1/g^2 of what
it did, and a base motion Y by (c0 + i c1 D / g + c2 / g^2) Y, the parts of inertia, drag and spring, with the D of `drag_of`.
"""

from __future__ import annotations

from typing import Any

from dforce.kernel.codegen import FIRST_DRIVE


def retune(tone: Any, response: Any, modes: int, g: float) -> None:
    """Change the row of a tone table to g times its frequency; `response` is the tone's row of ``kernel.responses``."""
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
    r"""Return real and imaginary part of a mode's drag over that of fluid which follows at once, at g times the frequency.

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
