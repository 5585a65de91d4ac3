r"""A resonance that is fitted to an averaged spectrum of thermal motion, over a white background.

.. math:: S(f) = W + \langle z^2 \rangle \frac{2}{\pi f_0 Q}\, \frac{1}{(1 - r^2)^2 + r^2 / Q^2}, \qquad r = \frac{f}{f_0}

one-sided (m²/Hz). Each point of an averaged spectrum scatters in proportion to its expected value (a gamma distribution).
The fit maximizes P. Whittle's likelihood: it minimizes the sum of ln S + P/S, by Fisher's scoring.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dforce.core.arrays import Array

ROUNDS, HALVINGS, CLOSE = 200, 30, 1e-10
TINY = 1e-100  # against division by zero
LONGEST = 1.0  # step in the logarithm of f0, Q or the mean square


@dataclass(frozen=True)
class Resonance:
    """A peak of a spectrum: frequency (Hz), quality factor, mean square (m²) and the white background (m²/Hz) below it."""

    f0: float
    Q: float
    mean_square: float
    background: float

    def density(self, frequency: Array) -> Array:
        """Return the power density (m²/Hz) at frequencies (Hz)."""
        return _model(_logs(self), np.asarray(frequency, dtype=float))[0]


@dataclass(frozen=True)
class FittedResonance:
    """A resonance as it was fitted.

    Attributes
    ----------
    peak
        The resonance.
    errors
        Relative standard errors of its f0, Q and mean square, where neighbors of the spectrum scatter independently.
    averages
        Spectra that were averaged, by the scatter about the fit.
    """

    peak: Resonance
    errors: tuple[float, float, float]
    averages: float


def most_likely(frequency: Array, power: Array, start: Resonance, beside: float | Array = 0.0) -> FittedResonance:
    """Return the resonance that makes an averaged spectrum most likely; its background is not negative.

    Parameters
    ----------
    frequency, power
        Frequencies (Hz) and power densities (m²/Hz), both above 0.
    start
        Where the search starts, with a background above 0.
    beside
        Power density (m²/Hz) that other resonances bring.

    Raises
    ------
    ArithmeticError
        When one resonance does not fit the spectrum.
    """
    found, scale = _logs(start), np.array([1.0, 1.0, 1.0, start.background])
    for _ in range(ROUNDS):
        own, slopes = _model(found, frequency)
        density = own + beside
        relative = slopes * scale / density[:, None]
        here = float(np.sum(np.log(density) + power / density))
        if not math.isfinite(here):
            raise ArithmeticError("no resonance describes the spectrum")
        free = np.array(
            [True, True, True, found[3] > 0.0 or float((relative[:, 3] * (power / density - 1.0)).sum()) > 0.0]
        )
        step = np.zeros(4)
        step[free] = np.linalg.lstsq(relative[:, free], power / density - 1.0, rcond=None)[0]
        step[:3] = np.clip(step[:3], -LONGEST, LONGEST)
        before = found
        for halving in range(HALVINGS):
            found = before + 0.5**halving * step * scale
            found[3] = max(found[3], 0.0)
            there = _model(found, frequency)[0] + beside
            if float(np.sum(np.log(there) + power / there)) <= here:
                break
        else:  # no step leads lower
            found = before
        if float(np.abs(found - before)[:3].max()) < CLOSE:
            break
    own, slopes = _model(found, frequency)
    density = own + beside
    relative = slopes * scale / density[:, None]
    scatter = float(np.mean((power / density - 1.0) ** 2)) * len(power) / max(len(power) - 4, 1)
    norms = np.maximum(np.linalg.norm(relative, axis=0), TINY)
    _, sizes, ways = np.linalg.svd(relative / norms, full_matrices=False)
    # a number that the spectrum does not constrain has an infinite error, not none
    f0, Q, mean_square = (math.sqrt(scatter) * np.linalg.norm(ways.T / np.maximum(sizes, TINY), axis=1) / norms)[
        :3
    ].tolist()
    peak = Resonance(*map(float, (*np.exp(found[:3]), found[3])))
    return FittedResonance(peak, (f0, Q, mean_square), 1.0 / max(scatter, 1e-12))


def _logs(peak: Resonance) -> Array:
    """Return the numbers of a resonance as they are fitted."""
    return np.array([*np.log([peak.f0, peak.Q, peak.mean_square]), peak.background])


def _model(found: Array, frequency: Array) -> tuple[Array, Array]:
    """Return the density, and its derivatives by the logarithms of f0, Q and mean square, and by the background."""
    f0, Q, mean_square = np.exp(found[:3])
    r2 = (frequency / f0) ** 2
    below = (1.0 - r2) ** 2 + r2 / Q**2
    peak = mean_square * 2.0 / (math.pi * f0 * Q) / below
    by_f0 = peak * (-1.0 + (-4.0 * (1.0 - r2) * r2 + 2.0 * r2 / Q**2) / below)
    by_Q = peak * (-1.0 + 2.0 * r2 / Q**2 / below)
    return peak + found[3], np.stack([by_f0, by_Q, peak, np.ones_like(peak)], axis=1)
