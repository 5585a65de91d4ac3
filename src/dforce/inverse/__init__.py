"""Inverse problems: from measured curves to parameters."""

from dforce.inverse.calibration import calibrate
from dforce.inverse.energies import energy
from dforce.inverse.measured import read_curves, read_measured
from dforce.inverse.thermal import ThermalTune, thermal_tune

__all__ = ["ThermalTune", "calibrate", "energy", "read_curves", "read_measured", "thermal_tune"]
