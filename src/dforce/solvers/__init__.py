"""Solvers: one file, one way to solve.

Only the settings are loaded here, since every case holds them; what loads numba is imported where something is solved.
"""

from dforce.solvers.settings import SolverSettings

__all__ = ["SolverSettings"]
