"""Sweeps: one experiment over a grid of any parameters, many cases at once, and maps of what they have in common."""

from dforce.sweeps._sweep import sweep
from dforce.sweeps.regime_map import regimes

__all__ = ["regimes", "sweep"]
