"""Thermal motion and noise: along curves, in many lanes, and their effect on fragile states."""

from dforce.thermal._lanes import noisy_motion
from dforce.thermal._noise_along_curve import noise
from dforce.thermal._ramp import snap_in_distance
from dforce.thermal._snap import snap_in_rate
from dforce.thermal._switching import switching_rate

__all__ = ["noise", "noisy_motion", "snap_in_distance", "snap_in_rate", "switching_rate"]
