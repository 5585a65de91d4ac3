"""Curves that are found again with more samples where the first number was too small.

A steep wall that is passed within a step may throw the tip out or let it through. The result is not a motion of the problem,
and its measurements violate the tip equation, see ``observables.misfit``.
"""

from __future__ import annotations

from dforce.solvers.settings import SolverSettings

FINER = (4, 16, 64)  # times the samples, one after the other until the numbers agree
MOST_SAMPLES = 65_536  # a period


class TooFewSamples(Exception):  # no error: a finer run takes its place
    """Motions were found that are none of the problem."""


def sample_counts(points: int, settings: SolverSettings) -> list[int]:
    """Return the samples per period to be tried, the fewest first."""
    refined = settings.integrator == "rk4" and settings.settle == "converged"
    return [points, *(times * points for times in FINER if refined and times * points <= MOST_SAMPLES)]
