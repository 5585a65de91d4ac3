"""Sweeps: one experiment over a grid of any parameters, many cases at once."""

from dforce.sweeps._sweep import sweep

__all__ = ["sweep"]
