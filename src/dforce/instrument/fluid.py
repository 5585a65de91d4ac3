r"""The fluid around a beam: the flow past a thin blade, free, and near a wall.

Force per length on a blade of width b that moves across itself by :math:`W e^{-i \omega t}`:
:math:`\tfrac{\pi}{4} \rho \omega^2 b^2 \Gamma W`, with :math:`\mathrm{Re} = \rho \omega b^2 / 4 \mu` and, near a wall, the gap
g over the width, H. The function :func:`dforce.instrument.beam.hydrodynamic_function` is a fit of the free blade.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from importlib import resources
from typing import Any, NamedTuple

import numpy as np

from dforce.core.errors import ParameterError
from dforce.instrument import beam

STATIONS = 32  # along the lever, by Gauss's rule, where the gap counts
LEAST_RE, MOST_RE = 0.01, 1000.0  # of the table near a wall
LEAST_GAP, MOST_GAP = 0.05, 10.0  # widths


@functools.cache
def _near_wall() -> tuple[Any, Any, Any, Any]:
    """Return splines of real part and log of the imaginary part, near the wall and without it."""
    from scipy.interpolate import CubicSpline, RectBivariateSpline

    text = (resources.files("dforce.library") / "hydrodynamic_wall.csv").read_text(encoding="utf-8")
    rows = np.array([[float(item) for item in line.split(",")] for line in text.splitlines()[2:]])
    re, gaps = np.unique(rows[:, 0]), np.unique(rows[:, 1])
    real, imaginary = (np.empty((len(re), len(gaps))) for _ in range(2))
    real[np.searchsorted(re, rows[:, 0]), np.searchsorted(gaps, rows[:, 1])] = rows[:, 2]
    imaginary[np.searchsorted(re, rows[:, 0]), np.searchsorted(gaps, rows[:, 1])] = np.log(rows[:, 3])
    x, y = np.log(re), np.log(gaps[:-1])
    near = [RectBivariateSpline(x, y, values[:, :-1]) for values in (real, imaginary)]
    free = [CubicSpline(x, values[:, -1]) for values in (real, imaginary)]
    return near[0], near[1], free[0], free[1]


def near_wall(reynolds: float, gap: Any) -> Any:
    r"""Return :math:`\Gamma(\mathrm{Re}, H)` of a thin blade at gaps, in widths, over a wall that the fluid sticks to.

    A spline through a table of the exact solution; beyond ten widths the wall's part falls as the inverse square.

    Raises
    ------
    ParameterError
        For Re outside of 0.01 to 1000, or a gap below 0.05 widths.
    """
    if not LEAST_RE <= reynolds <= MOST_RE:
        raise ParameterError(
            f"Re = {reynolds:.4g} is outside of {LEAST_RE} to {MOST_RE:g}, the known range of the flow at a wall"
        )
    least = float(np.min(gap))
    if not least >= LEAST_GAP:
        raise ParameterError(
            f"the gap is {least:.3g} widths of the lever, below {LEAST_GAP}, the limit of the known flow at a wall"
        )
    real, imaginary, free_real, free_imaginary = _near_wall()
    x = math.log(reynolds)
    y = np.log(np.minimum(gap, MOST_GAP))
    close = real.ev(x, y) + 1j * np.exp(imaginary.ev(x, y))
    far = complex(float(free_real(x)), math.exp(float(free_imaginary(x))))
    return far + (close - far) * np.minimum(1.0, MOST_GAP / np.asarray(gap)) ** 2


def known_near_wall(width: float, density: float, viscosity: float) -> tuple[float, float]:
    """Return between which frequencies (Hz) the flow at a wall is known."""
    at_one = beam.reynolds_number(1.0, width, density, viscosity)
    return LEAST_RE / at_one * (1.0 + 1e-12), MOST_RE / at_one * (1.0 - 1e-12)


class Wall(NamedTuple):
    """A wall below the lever: distance to its end (m), tilt (rad), and the lever's length (m)."""

    height: float
    tilt: float
    length: float


def free_flow(width: float, density: float, viscosity: float) -> Callable[[float], complex]:
    """Return the function that gives Γ of a beam far from any wall at a frequency (Hz)."""

    def gamma(frequency: float) -> complex:
        return beam.hydrodynamic_function(beam.reynolds_number(frequency, width, density, viscosity))

    return gamma


def wall_flow(n: int, width: float, density: float, viscosity: float, wall: Wall) -> Callable[[float], complex]:
    r"""Return the function that gives the mean Γ of mode `n` (from 1) of a beam over a wall at a frequency (Hz).

    The mean along the lever, with the square of the mode's shape, at the gap :math:`g(x) = h + (L - x) \sin\alpha` of each
    place (strip theory).
    """
    nodes, weights = np.polynomial.legendre.leggauss(STATIONS)
    places = 0.5 * (nodes + 1.0)
    shares = weights * beam.shape(n, places) ** 2
    shares /= shares.sum()
    gaps = (wall.height + (1.0 - places) * wall.length * math.sin(wall.tilt)) / width

    def gamma(frequency: float) -> complex:
        return complex(shares @ near_wall(beam.reynolds_number(frequency, width, density, viscosity), gaps))

    return gamma


def mode_near_wall(
    n: int,
    vacuum_frequency: float,
    beam_density: float,
    width: float,
    thickness: float,
    density: float,
    viscosity: float,
    wall: Wall,
) -> beam.FluidMode:
    r"""Return frequency (Hz), Q and added mass of mode `n` (from 1) of a beam over a wall.

    As :func:`dforce.instrument.beam.fluid_mode`, with the :math:`\Gamma` of :func:`wall_flow`.

    Raises
    ------
    ParameterError
        When no frequency satisfies the equation, or Re or gap leave the range of the theory.
    """
    load = math.pi * density * width / (4.0 * beam_density * thickness)
    flow = wall_flow(n, width, density, viscosity, wall)
    frequency = vacuum_frequency
    for _ in range(beam.ITERATIONS):
        gamma = flow(frequency)
        before, frequency = frequency, vacuum_frequency / math.sqrt(1.0 + load * gamma.real)
        if abs(frequency - before) <= 1e-13 * frequency:
            fluid = load * gamma.real
            return beam.FluidMode(frequency, (1.0 / load + gamma.real) / gamma.imag, fluid / (1.0 + fluid))
    raise ParameterError(
        "cantilever.beam has no resonance at this distance from the wall in this medium; write a larger tip_height"
    )
