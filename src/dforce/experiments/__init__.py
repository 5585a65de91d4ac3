"""Experiments: one file, one experiment; a class whose fields are its keys in a case."""

from dforce.experiments.approach import Approach
from dforce.experiments.base import Experiment, Grid, InitialMotion, RelativeGrid
from dforce.experiments.basins import AmplitudeGrid, Basins, DeflectionGrid, PhaseGrid, VelocityGrid
from dforce.experiments.branches import Branches, Span
from dforce.experiments.dwell import Dwell
from dforce.experiments.frequency_sweep import FrequencyGrid, FrequencySweep
from dforce.experiments.thermal_spectrum import ThermalSpectrum

EXPERIMENTS: dict[str, type[Experiment]] = {
    "dwell": Dwell,
    "approach": Approach,
    "branches": Branches,
    "frequency_sweep": FrequencySweep,
    "basins": Basins,
    "thermal_spectrum": ThermalSpectrum,
}

__all__ = [
    "EXPERIMENTS",
    "AmplitudeGrid",
    "Approach",
    "Basins",
    "Branches",
    "DeflectionGrid",
    "Dwell",
    "Experiment",
    "FrequencyGrid",
    "FrequencySweep",
    "Grid",
    "InitialMotion",
    "PhaseGrid",
    "RelativeGrid",
    "Span",
    "ThermalSpectrum",
    "VelocityGrid",
]
