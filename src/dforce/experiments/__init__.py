"""Experiments: one file, one experiment; a class whose fields are its keys in a case."""

from dforce.experiments._experiment import Experiment, Grid, InitialMotion
from dforce.experiments.approach import Approach
from dforce.experiments.dwell import Dwell

EXPERIMENTS: dict[str, type[Experiment]] = {"dwell": Dwell, "approach": Approach}

__all__ = ["EXPERIMENTS", "Approach", "Dwell", "Experiment", "Grid", "InitialMotion"]
