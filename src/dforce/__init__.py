"""dForce: a simulator of tapping-mode and bimodal atomic force microscopy."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dforce import forces, plot
    from dforce.bars import ProgressBar
    from dforce.case import About, Case, Range, Sweep, case_schema, example, load_case, save_case
    from dforce.errors import (
        CaseError,
        DForceError,
        ForceError,
        ParameterError,
        ResultError,
        UnitError,
        nearest,
        shorten,
    )
    from dforce.experiments import (
        EXPERIMENTS,
        Approach,
        Basins,
        Branches,
        Dwell,
        Experiment,
        FrequencyGrid,
        FrequencySweep,
        Grid,
        InitialMotion,
        Span,
    )
    from dforce.files import check_target, write_whole
    from dforce.findings import Finding, count_status, summary
    from dforce.forces import Force
    from dforce.instrument import (
        Beam,
        Cantilever,
        Contact,
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
    from dforce.kernel.store import KernelCache, clear_kernel_cache, kernel_cache
    from dforce.library import examples
    from dforce.library.cantilevers import cantilevers
    from dforce.notation import first_sentence, html_symbol, plain_math, unmarked
    from dforce.notices import listening
    from dforce.parameters import Parameters, Quantity, param, shared
    from dforce.plugins import load_plugin
    from dforce.prescribed import force_along, force_curve
    from dforce.problem import values_used
    from dforce.reports import Report, report
    from dforce.results import Status, read, reader_unit, write
    from dforce.revisit import motion_at
    from dforce.runs import approach, basins, branches, dwell, frequency_sweep, run
    from dforce.series import Line, Picture, drawable, goes_along, lines_of, pictures_of, rounding, row_of
    from dforce.setpoint import at_set_point, regime
    from dforce.solvers import SolverSettings
    from dforce.stopping import late_stop_waits, sigterm_as_ctrl_c
    from dforce.sweeps import sweep
    from dforce.testing import check_force
    from dforce.thermal import noise, noisy_motion, snap_in_rate, switching_rate, thermal_spectrum
    from dforce.timing import benchmark
    from dforce.timing.accuracy import cost_of_accuracy
    from dforce.units import parse, show, split_unit, unit_choices, usual_unit
    from dforce.validation import validate, validation_page
    from dforce.validity import Advice, advice, advice_in

# where each public name lives; loaded when first used, so that `import dforce` is quick
_HOMES = {
    "validity": ("Advice", "advice", "advice_in"),
    "bars": ("ProgressBar",),
    "case": ("About", "Case", "Range", "Sweep", "case_schema", "example", "load_case", "save_case"),
    "errors": (
        "CaseError",
        "DForceError",
        "ForceError",
        "ParameterError",
        "ResultError",
        "UnitError",
        "nearest",
        "shorten",
    ),
    "findings": ("Finding", "count_status", "summary"),
    "experiments": (
        "EXPERIMENTS",
        "Approach",
        "Basins",
        "Branches",
        "Dwell",
        "Experiment",
        "FrequencyGrid",
        "FrequencySweep",
        "Grid",
        "InitialMotion",
        "Span",
    ),
    "forces": ("Force",),
    "instrument": (
        "Beam",
        "Cantilever",
        "Contact",
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
    "kernel.store": ("KernelCache", "clear_kernel_cache", "kernel_cache"),
    "library": ("examples",),
    "library.cantilevers": ("cantilevers",),
    "notation": ("first_sentence", "html_symbol", "plain_math", "unmarked"),
    "notices": ("listening",),
    "parameters": ("Parameters", "Quantity", "param", "shared"),
    "plugins": ("load_plugin",),
    "problem": ("values_used",),
    "prescribed": ("force_along", "force_curve"),
    "reports": ("Report", "report"),
    "files": ("check_target", "write_whole"),
    "results": ("Status", "read", "reader_unit", "write"),
    "revisit": ("motion_at",),
    "runs": ("approach", "basins", "branches", "dwell", "frequency_sweep", "run"),
    "series": ("Line", "Picture", "drawable", "goes_along", "lines_of", "pictures_of", "rounding", "row_of"),
    "solvers": ("SolverSettings",),
    "setpoint": ("at_set_point", "regime"),
    "stopping": ("late_stop_waits", "sigterm_as_ctrl_c"),
    "sweeps": ("sweep",),
    "testing": ("check_force",),
    "thermal": ("noise", "noisy_motion", "snap_in_rate", "switching_rate", "thermal_spectrum"),
    "timing": ("benchmark",),
    "timing.accuracy": ("cost_of_accuracy",),
    "validation": ("validate", "validation_page"),
    "units": ("parse", "show", "split_unit", "unit_choices", "usual_unit"),
}
_MODULES = ("forces", "plot")
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "EXPERIMENTS",
    "About",
    "Advice",
    "Approach",
    "Basins",
    "Beam",
    "Branches",
    "Cantilever",
    "Case",
    "CaseError",
    "Contact",
    "DForceError",
    "Drive",
    "Dwell",
    "Experiment",
    "Finding",
    "Force",
    "ForceError",
    "FrequencyGrid",
    "FrequencySweep",
    "Grid",
    "InitialMotion",
    "KernelCache",
    "Line",
    "Medium",
    "Mode",
    "Noise",
    "ParameterError",
    "Parameters",
    "Picture",
    "Piezo",
    "ProgressBar",
    "Quantity",
    "Range",
    "Readout",
    "Report",
    "ResultError",
    "Sample",
    "SolverSettings",
    "Span",
    "Status",
    "Sweep",
    "Tip",
    "Tone",
    "UnitError",
    "advice",
    "advice_in",
    "approach",
    "at_set_point",
    "basins",
    "benchmark",
    "branches",
    "cantilevers",
    "case_schema",
    "check_force",
    "check_target",
    "clear_kernel_cache",
    "cost_of_accuracy",
    "count_status",
    "drawable",
    "dwell",
    "example",
    "examples",
    "first_sentence",
    "force_along",
    "force_curve",
    "forces",
    "frequency_sweep",
    "goes_along",
    "html_symbol",
    "kernel_cache",
    "late_stop_waits",
    "lines_of",
    "listening",
    "load_case",
    "load_plugin",
    "motion_at",
    "nearest",
    "noise",
    "noisy_motion",
    "param",
    "parse",
    "pictures_of",
    "plain_math",
    "plot",
    "read",
    "reader_unit",
    "regime",
    "report",
    "rounding",
    "row_of",
    "run",
    "save_case",
    "shared",
    "shorten",
    "show",
    "sigterm_as_ctrl_c",
    "snap_in_rate",
    "split_unit",
    "summary",
    "sweep",
    "switching_rate",
    "thermal_spectrum",
    "unit_choices",
    "unmarked",
    "usual_unit",
    "validate",
    "validation_page",
    "values_used",
    "write",
    "write_whole",
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
