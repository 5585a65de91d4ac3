"""Sweeps: one experiment over a grid of any parameters, many cases at once."""

from dforce.maps._sweep import sweep

__all__ = ["sweep"]
