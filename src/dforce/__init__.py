"""dForce: a simulator of tapping-mode and bimodal atomic force microscopy."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dforce import forces, plot
    from dforce.case import About, Case, Range, Sweep, case_schema, example, load_case, save_case
    from dforce.checks.battery import check_force
    from dforce.checks.benchmark import benchmark
    from dforce.checks.benchmark.accuracy import cost_of_accuracy
    from dforce.checks.validation import validate, validation_page
    from dforce.core.errors import (
        CaseError,
        DForceError,
        ForceError,
        ParameterError,
        ResultError,
        UnitError,
        nearest,
        shorten,
    )
    from dforce.core.files import check_target, write_whole
    from dforce.core.log import listening
    from dforce.core.notation import first_sentence, html_symbol, plain_math, unmarked
    from dforce.core.parameters import Parameters, Quantity, param, shared
    from dforce.core.progress import ProgressBar
    from dforce.core.stopping import late_stop_waits, sigterm_as_ctrl_c
    from dforce.core.units import parse, show, split_unit, unit_choices, usual_unit
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
    from dforce.findings.motion_at import motion_at
    from dforce.findings.report import Report, report
    from dforce.findings.set_point import at_set_point, regime
    from dforce.findings.summary import Finding, count_status, summary
    from dforce.forces import Force, load_plugin
    from dforce.instrument import Beam, Cantilever, Contact, Drive, Medium, Mode, Piezo, Readout, Sample, Tip, Tone
    from dforce.kernel.cache import KernelCache, clear_kernel_cache, kernel_cache
    from dforce.library import examples
    from dforce.library.cantilevers import cantilevers
    from dforce.maps import sweep
    from dforce.problem import values_used
    from dforce.results.curves import Line, Picture, drawable, goes_along, lines_of, pictures_of, rounding, row_of
    from dforce.results.dataset import Status, read, reader_unit, write
    from dforce.runs import approach, basins, branches, dwell, frequency_sweep, run
    from dforce.solvers import SolverSettings
    from dforce.spectroscopy import force_along, force_curve
    from dforce.validity import Advice, advice, advice_in

# where each public name lives; loaded when first used, so that `import dforce` is quick
_HOMES = {
    "case": (
        "About",
        "Case",
        "Range",
        "Sweep",
        "case_schema",
        "example",
        "load_case",
        "save_case",
    ),
    "checks.battery": ("check_force",),
    "checks.benchmark": ("benchmark",),
    "checks.benchmark.accuracy": ("cost_of_accuracy",),
    "checks.validation": (
        "validate",
        "validation_page",
    ),
    "core.errors": (
        "CaseError",
        "DForceError",
        "ForceError",
        "ParameterError",
        "ResultError",
        "UnitError",
        "nearest",
        "shorten",
    ),
    "core.files": (
        "check_target",
        "write_whole",
    ),
    "core.log": ("listening",),
    "core.notation": (
        "first_sentence",
        "html_symbol",
        "plain_math",
        "unmarked",
    ),
    "core.parameters": (
        "Parameters",
        "Quantity",
        "param",
        "shared",
    ),
    "core.progress": ("ProgressBar",),
    "core.stopping": (
        "late_stop_waits",
        "sigterm_as_ctrl_c",
    ),
    "core.units": (
        "parse",
        "show",
        "split_unit",
        "unit_choices",
        "usual_unit",
    ),
    "experiments": (
        "Approach",
        "Basins",
        "Branches",
        "Dwell",
        "EXPERIMENTS",
        "Experiment",
        "FrequencyGrid",
        "FrequencySweep",
        "Grid",
        "InitialMotion",
        "Span",
    ),
    "findings.motion_at": ("motion_at",),
    "findings.report": (
        "Report",
        "report",
    ),
    "findings.set_point": (
        "at_set_point",
        "regime",
    ),
    "findings.summary": (
        "Finding",
        "count_status",
        "summary",
    ),
    "forces": (
        "Force",
        "load_plugin",
    ),
    "instrument": (
        "Beam",
        "Cantilever",
        "Contact",
        "Drive",
        "Medium",
        "Mode",
        "Piezo",
        "Readout",
        "Sample",
        "Tip",
        "Tone",
    ),
    "kernel.cache": (
        "KernelCache",
        "clear_kernel_cache",
        "kernel_cache",
    ),
    "library": ("examples",),
    "library.cantilevers": ("cantilevers",),
    "maps": ("sweep",),
    "problem": ("values_used",),
    "results.curves": (
        "Line",
        "Picture",
        "drawable",
        "goes_along",
        "lines_of",
        "pictures_of",
        "rounding",
        "row_of",
    ),
    "results.dataset": (
        "Status",
        "read",
        "reader_unit",
        "write",
    ),
    "runs": (
        "approach",
        "basins",
        "branches",
        "dwell",
        "frequency_sweep",
        "run",
    ),
    "solvers": ("SolverSettings",),
    "spectroscopy": (
        "force_along",
        "force_curve",
    ),
    "validity": (
        "Advice",
        "advice",
        "advice_in",
    ),
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
    "split_unit",
    "summary",
    "sweep",
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
