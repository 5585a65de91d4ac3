"""dForce: a simulator of tapping-mode and bimodal atomic force microscopy."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dforce import experiments as experiments
    from dforce import forces as forces
    from dforce import plot as plot
    from dforce.case import Case as Case
    from dforce.case import example as example
    from dforce.case import load_case as load_case
    from dforce.case import save_case as save_case
    from dforce.checks.battery import check_force as check_force
    from dforce.core.errors import CaseError as CaseError
    from dforce.core.errors import DForceError as DForceError
    from dforce.core.errors import ForceError as ForceError
    from dforce.core.errors import ParameterError as ParameterError
    from dforce.core.errors import ResultError as ResultError
    from dforce.core.errors import UnitError as UnitError
    from dforce.core.parameters import param as param
    from dforce.core.parameters import shared as shared
    from dforce.core.units import parse as parse
    from dforce.core.units import show as show
    from dforce.findings.answer import answer as answer
    from dforce.findings.material import material as material
    from dforce.findings.motion_at import motion_at as motion_at
    from dforce.findings.report import report as report
    from dforce.findings.set_point import at_set_point as at_set_point
    from dforce.findings.summary import summary as summary
    from dforce.forces import Force as Force
    from dforce.forces import load_plugin as load_plugin
    from dforce.instrument import Beam as Beam
    from dforce.instrument import Cantilever as Cantilever
    from dforce.instrument import Contact as Contact
    from dforce.instrument import Drift as Drift
    from dforce.instrument import Drive as Drive
    from dforce.instrument import Medium as Medium
    from dforce.instrument import Mode as Mode
    from dforce.instrument import Noise as Noise
    from dforce.instrument import Piezo as Piezo
    from dforce.instrument import Readout as Readout
    from dforce.instrument import Sample as Sample
    from dforce.instrument import Tip as Tip
    from dforce.instrument import Tone as Tone
    from dforce.inverse.calibration import calibrate as calibrate
    from dforce.inverse.energies import energy as energy
    from dforce.inverse.fitting.foresight import identify as identify
    from dforce.inverse.fitting.foresight_words import identify_in_words as identify_in_words
    from dforce.inverse.fitting.foresight_words import identify_report as identify_report
    from dforce.inverse.fitting.many import fit_many as fit_many
    from dforce.inverse.fitting.repeat import fit_again as fit_again
    from dforce.inverse.fitting.report import chi2_in_words as chi2_in_words
    from dforce.inverse.fitting.report import compare_fits as compare_fits
    from dforce.inverse.fitting.report import fit_report as fit_report
    from dforce.inverse.fitting.run import fit as fit
    from dforce.inverse.heads import FileHead as FileHead
    from dforce.inverse.heads import file_head as file_head
    from dforce.inverse.measured import read_curves as read_curves
    from dforce.inverse.measured import read_measured as read_measured
    from dforce.inverse.plan_file import load_plan as load_plan
    from dforce.inverse.planner import plan as plan
    from dforce.inverse.reconstruction import reconstruct as reconstruct
    from dforce.inverse.safety import safe_settings as safe_settings
    from dforce.inverse.thermal import ThermalTune as ThermalTune
    from dforce.inverse.thermal import thermal_tune as thermal_tune
    from dforce.kernel.cache import clear_kernel_cache as clear_kernel_cache
    from dforce.kernel.cache import kernel_cache as kernel_cache
    from dforce.library import examples as examples
    from dforce.library.cantilevers import cantilevers as cantilevers
    from dforce.library.materials import materials as materials
    from dforce.maps import regimes as regimes
    from dforce.maps import sweep as sweep
    from dforce.results.files import read as read
    from dforce.results.files import write as write
    from dforce.results.status import Status as Status
    from dforce.runs import approach as approach
    from dforce.runs import basins as basins
    from dforce.runs import branches as branches
    from dforce.runs import dwell as dwell
    from dforce.runs import frequency_sweep as frequency_sweep
    from dforce.runs import run as run
    from dforce.runs import thermal_spectrum as thermal_spectrum
    from dforce.solvers import SolverSettings as SolverSettings
    from dforce.spectroscopy import force_along as force_along
    from dforce.spectroscopy import force_curve as force_curve
    from dforce.spectroscopy import force_parts as force_parts
    from dforce.thermal import noise as noise
    from dforce.thermal import noisy_motion as noisy_motion
    from dforce.thermal import snap_in_distance as snap_in_distance
    from dforce.thermal import snap_in_rate as snap_in_rate
    from dforce.thermal import switching_rate as switching_rate
    from dforce.validity import Advice as Advice
    from dforce.validity import advice as advice

# where each public name lives; loaded when first used, so that `import dforce` is quick
_HOMES = {
    "case": ("Case", "example", "load_case", "save_case"),
    "checks.battery": ("check_force",),
    "core.errors": ("CaseError", "DForceError", "ForceError", "ParameterError", "ResultError", "UnitError"),
    "core.parameters": ("param", "shared"),
    "core.units": ("parse", "show"),
    "findings.answer": ("answer",),
    "findings.material": ("material",),
    "findings.motion_at": ("motion_at",),
    "findings.report": ("report",),
    "findings.set_point": ("at_set_point",),
    "findings.summary": ("summary",),
    "forces": ("Force", "load_plugin"),
    "instrument": (
        "Beam",
        "Cantilever",
        "Contact",
        "Drift",
        "Drive",
        "Medium",
        "Mode",
        "Noise",
        "Piezo",
        "Readout",
        "Sample",
        "Tip",
        "Tone",
    ),
    "inverse.calibration": ("calibrate",),
    "inverse.energies": ("energy",),
    "inverse.fitting.foresight": ("identify",),
    "inverse.fitting.foresight_words": ("identify_in_words", "identify_report"),
    "inverse.fitting.many": ("fit_many",),
    "inverse.fitting.repeat": ("fit_again",),
    "inverse.fitting.report": ("chi2_in_words", "compare_fits", "fit_report"),
    "inverse.fitting.run": ("fit",),
    "inverse.heads": ("FileHead", "file_head"),
    "inverse.measured": ("read_curves", "read_measured"),
    "inverse.plan_file": ("load_plan",),
    "inverse.planner": ("plan",),
    "inverse.reconstruction": ("reconstruct",),
    "inverse.safety": ("safe_settings",),
    "inverse.thermal": ("ThermalTune", "thermal_tune"),
    "kernel.cache": ("clear_kernel_cache", "kernel_cache"),
    "library": ("examples",),
    "library.cantilevers": ("cantilevers",),
    "library.materials": ("materials",),
    "maps": ("regimes", "sweep"),
    "results.files": ("read", "write"),
    "results.status": ("Status",),
    "runs": ("approach", "basins", "branches", "dwell", "frequency_sweep", "run", "thermal_spectrum"),
    "solvers": ("SolverSettings",),
    "spectroscopy": ("force_along", "force_curve", "force_parts"),
    "thermal": ("noise", "noisy_motion", "snap_in_distance", "snap_in_rate", "switching_rate"),
    "validity": ("Advice", "advice"),
}
_MODULES = ("experiments", "forces", "plot")
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [*sorted([*_MODULES, *_HOME_OF])]  # noqa: PLE0604


def __getattr__(name: str) -> object:
    if name == "__version__":
        from dforce._version import __version__

        return __version__
    if name in _MODULES:
        return importlib.import_module(f"dforce.{name}")
    if name not in _HOME_OF:
        raise AttributeError(f"module 'dforce' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"dforce.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
