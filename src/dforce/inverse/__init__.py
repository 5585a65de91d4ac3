"""From measured curves back to forces, parameters and settings."""

from dforce.inverse.calibration import calibrate
from dforce.inverse.energies import energy
from dforce.inverse.heads import FileHead, file_head
from dforce.inverse.measured import read_curves, read_measured
from dforce.inverse.thermal import ThermalTune, thermal_tune

__all__ = [
    "FileHead",
    "ThermalTune",
    "calibrate",
    "energy",
    "file_head",
    "read_curves",
    "read_measured",
    "thermal_tune",
]
