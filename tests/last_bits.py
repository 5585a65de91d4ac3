"""Other last bits: levers that differ in the last place, so that each step of a motion is rounded otherwise."""

from dataclasses import replace

import numpy as np
import pytest

from dforce.problem import Problem


def put_levers_off(patch: pytest.MonkeyPatch, ulps: int) -> None:
    """Put f0, k and Q of each mode so many units in the last place off, as another processor's rounding would.

    No result can be certain to less. Distances where forces have kinks stay where they are.
    """
    build = Problem.build

    def off(value):
        return value + ulps * float(np.spacing(value))

    def built(*parts, **named):
        problem = build(*parts, **named)
        modes = tuple(replace(mode, f0=off(mode.f0), k=off(mode.k), Q=off(mode.Q)) for mode in problem.modes)
        return replace(problem, modes=modes)

    patch.setattr(Problem, "build", staticmethod(built))
