"""dForce: a simulator of tapping-mode and bimodal atomic force microscopy."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dforce import experiments, forces, plot
    from dforce.case import Case, example, load_case, save_case
    from dforce.checks.battery import check_force
    from dforce.core.errors import CaseError, DForceError, ForceError, ParameterError, ResultError, UnitError
    from dforce.core.parameters import param, shared
    from dforce.core.units import parse, show
    from dforce.findings.answer import answer
    from dforce.findings.material import material
    from dforce.findings.motion_at import motion_at
    from dforce.findings.report import report
    from dforce.findings.set_point import at_set_point
    from dforce.findings.summary import summary
    from dforce.forces import Force, load_plugin
    from dforce.instrument import (
        Beam,
        Cantilever,
        Contact,
        Drift,
        Drive,
        Medium,
        Mode,
        Noise,
        Piezo,
        Readout,
        Sample,
        Tip,
        Tone,
    )
    from dforce.inverse import (
        FileHead,
        ThermalTune,
        calibrate,
        energy,
        file_head,
        read_curves,
        read_measured,
        thermal_tune,
    )
    from dforce.inverse.fitting import (
        chi2_in_words,
        compare_fits,
        fit,
        fit_again,
        fit_many,
        fit_report,
        identify,
        identify_in_words,
        identify_report,
    )
    from dforce.inverse.plan_file import load_plan
    from dforce.inverse.planner import plan
    from dforce.inverse.reconstruction import reconstruct
    from dforce.inverse.safety import safe_settings
    from dforce.kernel.cache import clear_kernel_cache, kernel_cache
    from dforce.library import examples
    from dforce.library.cantilevers import cantilevers
    from dforce.library.materials import materials
    from dforce.maps import regimes, sweep
    from dforce.results.files import read, write
    from dforce.results.status import Status
    from dforce.runs import approach, basins, branches, dwell, frequency_sweep, run, thermal_spectrum
    from dforce.solvers import SolverSettings
    from dforce.spectroscopy import force_along, force_curve, force_parts
    from dforce.thermal import noise, noisy_motion, snap_in_distance, snap_in_rate, switching_rate
    from dforce.validity import Advice, advice

# where each public name lives; loaded when first used, so that `import dforce` is quick
_HOMES = {
    "case": ("Case", "example", "load_case", "save_case"),
    "checks.battery": ("check_force",),
    "core.errors": ("CaseError", "DForceError", "ForceError", "ParameterError", "ResultError", "UnitError"),
    "core.parameters": ("param", "shared"),
    "core.units": ("parse", "show"),
    "findings.material": ("material",),
    "findings.motion_at": ("motion_at",),
    "findings.report": ("report",),
    "findings.answer": ("answer",),
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
    "inverse": (
        "FileHead",
        "ThermalTune",
        "calibrate",
        "energy",
        "file_head",
        "read_curves",
        "read_measured",
        "safe_settings",
        "thermal_tune",
    ),
    "inverse.fitting": (
        "chi2_in_words",
        "compare_fits",
        "fit",
        "fit_again",
        "fit_many",
        "fit_report",
        "identify",
        "identify_in_words",
        "identify_report",
    ),
    "inverse.plan_file": ("load_plan",),
    "inverse.planner": ("plan",),
    "inverse.reconstruction": ("reconstruct",),
    "inverse.safety": ("safe_settings",),
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

__all__ = [
    "Advice",
    "Beam",
    "Cantilever",
    "Case",
    "CaseError",
    "Contact",
    "DForceError",
    "Drift",
    "Drive",
    "FileHead",
    "Force",
    "ForceError",
    "Medium",
    "Mode",
    "Noise",
    "ParameterError",
    "Piezo",
    "Readout",
    "ResultError",
    "Sample",
    "SolverSettings",
    "Status",
    "ThermalTune",
    "Tip",
    "Tone",
    "UnitError",
    "advice",
    "answer",
    "approach",
    "at_set_point",
    "basins",
    "branches",
    "calibrate",
    "cantilevers",
    "check_force",
    "chi2_in_words",
    "clear_kernel_cache",
    "compare_fits",
    "dwell",
    "energy",
    "example",
    "examples",
    "experiments",
    "file_head",
    "fit",
    "fit_again",
    "fit_many",
    "fit_report",
    "force_along",
    "force_curve",
    "force_parts",
    "forces",
    "frequency_sweep",
    "identify",
    "identify_in_words",
    "identify_report",
    "kernel_cache",
    "load_case",
    "load_plan",
    "load_plugin",
    "material",
    "materials",
    "motion_at",
    "noise",
    "noisy_motion",
    "param",
    "parse",
    "plan",
    "plot",
    "read",
    "read_curves",
    "read_measured",
    "reconstruct",
    "regimes",
    "report",
    "run",
    "safe_settings",
    "save_case",
    "shared",
    "show",
    "snap_in_distance",
    "snap_in_rate",
    "summary",
    "sweep",
    "switching_rate",
    "thermal_spectrum",
    "thermal_tune",
    "write",
]


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
