"""Sweeps: one experiment over a grid of any parameters, many cases at once, and maps of the results."""

from dforce.maps._sweep import sweep
from dforce.maps.regime_map import regimes

__all__ = ["regimes", "sweep"]
