"""A case: everything that a run depends on; a file, a Python object and a schema, without loss."""

from dforce.case._case import About, Case
from dforce.case._files import case_of, cases_of, example, load_case, save_case
from dforce.case._fit import Data, Fit
from dforce.case._schema import case_schema
from dforce.case._sweep import MOST_VALUES, Range, Sweep

__all__ = [
    "MOST_VALUES",
    "About",
    "Case",
    "Data",
    "Fit",
    "Range",
    "Sweep",
    "case_of",
    "case_schema",
    "cases_of",
    "example",
    "load_case",
    "save_case",
]
