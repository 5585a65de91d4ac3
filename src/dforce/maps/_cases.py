"""The cases of a sweep, however they are computed: side by side where that is possible, else one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from dforce.case import Case
from dforce.core.parallel import Crew
from dforce.maps._one_by_one import OneByOne
from dforce.maps._part import SideBySide
from dforce.maps._result import Layout
from dforce.maps.axes import Axis

if TYPE_CHECKING:
    import xarray as xr


class Cases(Protocol):
    """The cases of a sweep, or of a block of it."""

    layout: Layout

    def take(self, earlier: xr.Dataset) -> int:
        """Take over the cases that an interrupted sweep has whole; return the number of their points."""

    def compute(self, crew: Crew, kept: frozenset[str], checks: bool = True) -> bool:
        """Compute the cases that are missing; return False when stopped before the end.

        Parameters
        ----------
        kept
            Names of the quantities that are kept.
        checks
            Whether cases at the corners are validated as a whole.
        """

    def result(self, asked: Case) -> xr.Dataset:
        """Return what was found, with the words and the case that was asked for."""


def cases_of(case: Case, axes: list[Axis]) -> Cases:
    """Return the cases of a sweep."""
    layout = Layout(case, axes)
    return SideBySide(case, layout) if layout.plan is not None else OneByOne(case, layout)
