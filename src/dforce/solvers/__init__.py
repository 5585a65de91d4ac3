"""Solvers: one file, one way to solve.

Only the settings are loaded here, since every case has them; modules that load numba are imported where they solve.
"""

from dforce.solvers.settings import SolverSettings

__all__ = ["SolverSettings"]
