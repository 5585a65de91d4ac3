"""dForce: a simulator of tapping-mode and bimodal atomic force microscopy."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dforce import forces, plot
    from dforce.case import Case, case_schema, example, load_case, save_case
    from dforce.errors import CaseError, DForceError, ForceError, ParameterError, ResultError, UnitError
    from dforce.experiments import Approach, Dwell, Grid, InitialMotion
    from dforce.forces import Force
    from dforce.instrument import Beam, Cantilever, Contact, Drive, Medium, Mode, Sample, Tip, Tone
    from dforce.library import examples
    from dforce.parameters import param, shared
    from dforce.results import Status, read, write
    from dforce.runs import approach, dwell, run
    from dforce.solvers import SolverSettings
    from dforce.units import parse, show

# where each public name lives; loaded when first used, so that `import dforce` is quick
_HOMES = {
    "case": ("Case", "case_schema", "example", "load_case", "save_case"),
    "errors": ("CaseError", "DForceError", "ForceError", "ParameterError", "ResultError", "UnitError"),
    "experiments": ("Approach", "Dwell", "Grid", "InitialMotion"),
    "forces": ("Force",),
    "instrument": ("Beam", "Cantilever", "Contact", "Drive", "Medium", "Mode", "Sample", "Tip", "Tone"),
    "library": ("examples",),
    "parameters": ("param", "shared"),
    "results": ("Status", "read", "write"),
    "runs": ("approach", "dwell", "run"),
    "solvers": ("SolverSettings",),
    "units": ("parse", "show"),
}
_MODULES = ("forces", "plot")
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "Approach",
    "Beam",
    "Cantilever",
    "Case",
    "CaseError",
    "Contact",
    "DForceError",
    "Drive",
    "Dwell",
    "Force",
    "ForceError",
    "Grid",
    "InitialMotion",
    "Medium",
    "Mode",
    "ParameterError",
    "ResultError",
    "Sample",
    "SolverSettings",
    "Status",
    "Tip",
    "Tone",
    "UnitError",
    "approach",
    "case_schema",
    "dwell",
    "example",
    "examples",
    "forces",
    "load_case",
    "param",
    "parse",
    "plot",
    "read",
    "run",
    "save_case",
    "shared",
    "show",
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
