"""The layout of a sweep, and the words of its result."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from dforce.case import Case
from dforce.case.paths import changed
from dforce.core.errors import DForceError, ParameterError
from dforce.core.files import beside
from dforce.core.quantities import jumps_along
from dforce.experiments.base import CurveExperiment
from dforce.maps.axes import Axis, amplitude_axis, dims_of
from dforce.procedures.found import Layout
from dforce.results.dataset import describe
from dforce.results.provenance import of_case

if TYPE_CHECKING:
    import xarray as xr

RATIO = "zc_ratio"  # dimension of distances that are shares of an amplitude which varies
CORNERS = 64  # of the grid, at most, that are validated as whole cases


class SweepLayout(Layout):
    """The places of the cases of a sweep, and of their points, in the result.

    A part is all cases with the same choices; its cases differ in numbers.

    Attributes
    ----------
    plan
        The curve of each case, where curves along the distance are solved side by side; None: each case by itself.
    side_by_side
        The case of each part, with its choices, where curves are solved side by side.
    jumps
        Names of the jumps that cases may have.
    free
        The axis of the amplitude of which the distances are shares.
    """

    def __init__(self, case: Case, axes: list[Axis]) -> None:
        experiment, problem = case.experiment, case.problem
        assert experiment is not None
        plan = experiment.plan(problem) if isinstance(experiment, CurveExperiment) else None
        self.jumps = jumps_along(plan.name) if plan is not None and plan.coords else []
        self.case, self.axes = case, axes
        self.choices = [axis for axis in axes if axis.quantity is None]
        self.numbers = [axis for axis in axes if axis.quantity is not None]
        inner = self._coords = experiment.coordinates(problem)
        shares = None if plan is None else plan.shares
        self.free = None if shares is None else amplitude_axis(case, axes)
        if self.free is not None:
            inner = {RATIO if dim == "zc" else dim: values for dim, values in inner.items()} | {RATIO: shares}
        self.side_by_side = self._parts(case) if plan is not None and plan.zc is None else []
        if any(one.problem.is_locked for one in self.side_by_side):
            self.side_by_side = []
        plans = [cast(CurveExperiment, one.experiment).plan(one.problem) for one in self.side_by_side]
        super().__init__(plans, inner, dims_of(axes), tuple(dims_of((*self.choices, *self.numbers))))

    def _parts(self, case: Case) -> list[Case]:
        """Return the cases with all combinations of the choices."""
        if not self.choices:
            return [case]
        paths, values = [axis.path for axis in self.choices], (axis.values for axis in self.choices)
        with beside(case.folder):
            cases = [
                type(case)(**changed(case, zip(paths, chosen, strict=True))) for chosen in itertools.product(*values)
            ]
        for one in cases:
            self.check(one)
        return cases

    def corners(self, most: int) -> Iterator[dict[str, int]]:
        """Give the places of the corners of the grid, at most so many."""
        ends = [sorted({0, length - 1}) for length in self.lengths.values()]
        for corner in itertools.islice(itertools.product(*ends), most):
            yield dict(zip(self.lengths, corner, strict=True))

    def case_at(self, place: Mapping[str, int]) -> Case:
        """Return the case at a place of the grid, validated as a whole."""
        values = [(axis.path, axis.values[place[axis.dim]]) for axis in self.axes]
        try:
            with beside(self.case.folder):  # of its plug-ins
                return type(self.case)(**changed(self.case, values))
        except DForceError as error:
            raise type(error)(f"at {self.where(place)}: {error}") from None

    def where(self, place: Mapping[str, int]) -> str:
        """Return the values at a place of the grid for a reader."""
        return ", ".join(axis.text(place[axis.dim]) for axis in self.axes)

    def check_corners(self) -> None:
        """Check the cases at the corners of the grid; see :meth:`check`."""
        for corner in self.corners(CORNERS):
            case = self.case_at(corner)
            if self.free is None:  # the distances themselves differ with the amplitude
                self.check(case)

    def check(self, case: Case) -> None:
        """Check that a case has the dimensions known beforehand.

        Raises
        ------
        ParameterError
            When it has others.
        """
        assert case.experiment is not None
        own = case.experiment.coordinates(case.problem)
        for name in self._coords | own:
            if not np.array_equal(own.get(name, ()), self._coords.get(name, ())):
                raise ParameterError(f"{name} differs from case to case; give all cases the same in the experiment")

    @property
    def distances(self) -> tuple[tuple[str, str], Any] | None:
        """The coordinate `zc` of distances that are shares of an amplitude which varies: dimensions and values (m)."""
        if self.free is None:
            return None
        return (self.free.dim, RATIO), np.multiply.outer(np.array(self.free.values), self.inner[RATIO])


def finished(data: xr.Dataset, case: Case, layout: SweepLayout) -> xr.Dataset:
    """Give a sweep its axes, its words and its provenance."""
    if layout.distances is not None:
        data = data.assign_coords(zc=layout.distances).assign_attrs(along=RATIO)
    data = describe(data).assign_coords({axis.name: axis.coordinate() for axis in layout.axes})
    over = {"over": " ".join(axis.path for axis in layout.axes)}
    data.attrs = of_case(case) | over | data.attrs
    return data
