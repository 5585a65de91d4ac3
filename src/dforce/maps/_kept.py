"""Quantities that a sweep keeps of each case: of all its points or of the states at a set point alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from dforce.core.errors import ParameterError, nearest, shorten
from dforce.core.quantities import AXES, NOISES, OBSERVABLES, jumps_along
from dforce.core.units import parse_share
from dforce.experiments import Approach
from dforce.findings.crossings import GUESSES, RATIO
from dforce.findings.set_point import at_set_point
from dforce.maps._result import SweepLayout
from dforce.procedures.found import KEPT

if TYPE_CHECKING:
    import xarray as xr

QUANTITIES = "quantities"  # attribute of an interrupted sweep: the names of the kept quantities
ALL = KEPT | frozenset(jumps_along("zc"))
NEEDED = frozenset({RATIO, "virial", *GUESSES})  # of a curve, for its states at a set point


@dataclass(frozen=True)
class Kept:
    """The names of the quantities, and the set point; None: all points are kept."""

    names: frozenset[str]
    set_point: float | None = None

    @classmethod
    def of(
        cls,
        quantities: Iterable[str] | None,
        set_point: float | str | None,
        layout: SweepLayout,
        before: str | None = None,
    ) -> Kept:
        """Return the kept quantities; without `quantities` the names that a continued sweep has noted, else all.

        Raises
        ------
        ParameterError
            For an unknown name, names that differ from the continued sweep's, a set point that is no share, or cases without
            set points.
        """
        share = None if set_point is None else parse_share(set_point, "at_set_point")
        if share is not None and not isinstance(layout.case.experiment, Approach):
            raise ParameterError("a set point needs the curve of an approach; use an approach as experiment")
        given = None if quantities is None else frozenset(quantities)
        known = frozenset(OBSERVABLES) if share is not None else ALL
        if layout.plan is None:
            known |= frozenset(AXES) | frozenset(NOISES)
        for name in sorted((given or frozenset()) - known):
            where = "" if share is None else " at a set point"
            raise ParameterError(f"there is no quantity '{shorten(name)}'{where}{nearest(name, known)}")
        earlier = ALL if before is None else frozenset(before.split())
        if before is not None and given not in (None, earlier):
            raise ParameterError(
                "this sweep keeps other quantities, so it cannot be continued with the present ones; leave quantities out"
            )
        return cls(earlier if given is None else given, share)

    @property
    def computed(self) -> frozenset[str]:
        """The quantities that are computed for it."""
        return self.names if self.set_point is None else self.names | NEEDED

    @property
    def unfinished(self) -> dict[str, Any]:
        """The attributes by which a sweep that is not complete goes on."""
        return {"interrupted": 1, QUANTITIES: " ".join(sorted(self.names))}

    def take(self, data: xr.Dataset) -> xr.Dataset:
        """Return the kept results of cases; at a set point :func:`dforce.at_set_point` gives them."""
        if self.set_point is None:
            return data
        return at_set_point(data, self.set_point, None if self.names == ALL else sorted(self.names))
