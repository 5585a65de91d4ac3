"""Branches: all steady states along the distance or any other parameter, stable and unstable, through folds."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
import pydantic

from dforce.core import units
from dforce.core.errors import ParameterError, UnitError
from dforce.core.marks import words
from dforce.core.parameters import Number, ParameterQuantity, Parameters, Part, param
from dforce.core.quantities import MOTION, REPEATS
from dforce.core.stopping import heard
from dforce.experiments.base import CaseLike, DistanceExperiment, Progress, whole_range

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import xarray as xr

    from dforce.kernel import Array
    from dforce.problem import Problem
    from dforce.solvers import SolverSettings
    from dforce.solvers.continuation import Curve
    from dforce.solvers.orbit import ParameterRange

UNDER_WAY = "under_way"  # of a stopped run: the number of the search, 0 before the first one, and the curves before it
BEGUN = "begun"  # of a stopped run: where each curve was found, see `Curve`
FREQUENCY = re.compile(r"drive(?:\.tones\.(\d+))?\.frequency")


class Span(Parameters):
    """A range of average distances, along which states are followed from `start` on."""

    title_of: ClassVar[str] = "zc"

    start: Number = param(
        unit="m", symbol="z_c", doc="average distance to start at; far away, where there is one state"
    )
    stop: Number = param(unit="m", symbol="z_c", doc="average distance to end at")


def _span_of_pair(given: Any) -> Any:
    """Turn a pair of distances into a range."""
    return {"start": given[0], "stop": given[1]} if isinstance(given, tuple) and len(given) == 2 else given


class Branches(DistanceExperiment):
    """All steady states along a parameter, stable or not: the curves of periodic orbits, through folds."""

    kind: Literal["branches"] = "branches"
    zc: Part[Annotated[Span | float, pydantic.BeforeValidator(_span_of_pair)]] = param(
        unit="m", symbol="z_c", doc="range {start, stop} of average distances; one distance where a parameter is given"
    )
    parameter: str | None = words(
        None,
        max_length=200,
        title="Parameter to vary instead of the distance",
        examples=["sample.youngs_modulus", "drive.A0", "drive.frequency", "cantilever.Q", "tip.radius"],
        description="path of the parameter to vary in place of zc, such as sample.youngs_modulus; "
        "a drive frequency is varied at constant driving force",
    )
    start: float | str | None = words(None, description="value of the parameter to start at")
    stop: float | str | None = words(None, description="value of the parameter to end at")
    largest_step: float = pydantic.Field(
        default=0.01,
        gt=0.0,
        le=0.5,
        description="largest step along a curve, relative to the range and to the free amplitude",
    )
    max_points: int = pydantic.Field(default=10_000, ge=2, le=1_000_000, description="points of all curves, at most")
    search: int = pydantic.Field(
        default=7, ge=0, le=1000, description="number of values at which states on other curves are looked for"
    )

    @pydantic.model_validator(mode="after")
    def _one_range(self) -> Self:
        if self.parameter is None:
            if not isinstance(self.zc, Span):
                raise ParameterError("experiment.zc is one distance; give a range, or a parameter with start and stop")
            if self.zc.start == self.zc.stop:
                raise ParameterError("experiment.zc starts where it stops; give two distances")
            if self.start is not None or self.stop is not None:
                raise ParameterError("experiment.start and stop go with a parameter; zc is a range by itself")
        elif isinstance(self.zc, Span):
            raise ParameterError(f"experiment.zc is a range, and so is that of {self.parameter}; give one distance")
        elif self.start is None or self.stop is None:
            raise ParameterError(f"experiment.start and stop (the range of {self.parameter}) are missing")
        return self

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return typical distances; see :class:`Experiment`."""
        return {"zc": whole_range(problem)}

    def run(
        self,
        problem: Problem,
        settings: SolverSettings,
        progress: Progress,
        earlier: xr.Dataset | None = None,
        case: CaseLike | None = None,
    ) -> xr.Dataset:
        """Return the points of all curves, one curve after the other; see :class:`Experiment`."""
        from dforce.solvers.continuation import Curve
        from dforce.solvers.doubling import doublings
        from dforce.solvers.orbit import ParameterRange
        from dforce.solvers.search import Known, search

        start, stop, quantity, anywhere = self._range(problem, case)
        low, high = min(start, stop), max(start, stop)

        def at(value: float) -> Problem:
            return anywhere(min(max(value, low), high))  # beyond the range, by a rounding, it may not be allowed

        zc = None if isinstance(self.zc, Span) else self.zc
        among = ParameterRange(at, start, stop, settings, self.harmonics, zc)
        searched = np.linspace(start, stop, self.search)
        curves: list[Curve] = []
        kept: list[Curve] = []  # of an earlier run, from the search that it was stopped in on
        # which search, and how many curves there were before it; after the last one doubled motions are followed
        under_way, total = (0, 0), 2 + self.search
        if earlier is not None:
            kept, under_way = self._restored(earlier, among), tuple(earlier.attrs[UNDER_WAY].tolist())
            curves, kept = kept[: under_way[1]], kept[under_way[1] :]

        def watch() -> None:
            done = under_way[0]
            if not curves:
                return progress(done, total, "")
            last = max((curves[-1].forth, curves[-1].back), key=len)[-1]
            here = units.show(last.value, quantity.unit, 4)
            return progress(done, total, f"curve {len(curves)}, {self._name()} = {here}")

        def grow(curve: Curve) -> bool:
            left = self.max_points - sum(len(curve.points) for curve in curves)
            if left > 1:
                # a search that is done again finds the same orbits in the same order
                curves.append(kept.pop(0) if kept else curve)
                curves[-1].grow(among, self.largest_step, left, watch)
            return left > 1

        def found() -> Iterator[Curve]:
            number, _ = under_way
            if number <= self.search:
                return search(Known(among, curves, searched[number - 1] / among.span), watch)
            return doublings(among, curves, self.largest_step, watch)

        try:
            first = among.free_orbit(start / among.span) if under_way[0] == 0 else None
            if first is not None:
                grow(Curve.rising(first, stop - start))
            for number in range(max(1, under_way[0]), total):
                under_way = number, len(curves)
                for curve in found():
                    if not grow(curve):
                        break
                while kept and grow(kept[0]):  # a search on another machine may miss what the first one has found
                    pass
            progress(total, total, "")
        except KeyboardInterrupt:
            heard()
            data = self._dataset(among, curves + kept, quantity, searched)
            begun = np.array([curve.begun for curve in curves + kept], dtype=int)
            data.attrs |= {"interrupted": 1, UNDER_WAY: np.array(under_way), BEGUN: begun}
            data.attrs["completeness"] = "not checked: the run was stopped"
            return data
        return self._dataset(among, curves, quantity, searched)

    def _restored(self, earlier: xr.Dataset, among: ParameterRange) -> list[Curve]:
        """Return the curves of an interrupted result: their motions tell all else."""
        from dforce.experiments.motion import base_of, scales_of, split_rows
        from dforce.solvers.continuation import Curve

        states, values = split_rows(earlier[MOTION].values, among.problem), earlier[self._name()].values.tolist()
        for i, value in enumerate(values):
            problem = among.problem_at(value)
            states.x[i] += base_of(problem) * scales_of(problem)
        steps, repeats = earlier["corrections"].values.tolist(), (earlier[REPEATS].values // among.common).tolist()
        orbits = [
            replace(among.orbit(value, states.take([i]), steps[i], repeats[i]), special=str(special))
            for i, (value, special) in enumerate(zip(values, earlier["special"].values, strict=True))
        ]
        places = [np.flatnonzero(earlier["branch"].values == n + 1) for n in range(np.size(earlier.attrs[BEGUN]))]
        return [
            Curve.of_points([orbits[i] for i in some], int(begun))
            for some, begun in zip(places, np.atleast_1d(earlier.attrs[BEGUN]), strict=True)
        ]

    def problem_at(self, problem: Problem, point: xr.Dataset, case: CaseLike) -> Problem:
        """Return the problem at the value of the parameter of a point; see :class:`Experiment`."""
        value = float(point[self._name()])
        return self._range(problem, case)[3](value).at_height(value if isinstance(self.zc, Span) else self.zc)

    def _name(self) -> str:
        """Return the name of the coordinate that holds the parameter: the last step of its path."""
        from dforce.core.quantities import OBSERVABLES

        if self.parameter is None:
            return "zc"
        last = self.parameter.rsplit(".", 1)[-1]
        return last if last not in OBSERVABLES else self.parameter.replace(".", "_")

    def _range(
        self, problem: Problem, case: CaseLike | None
    ) -> tuple[float, float, ParameterQuantity, Callable[[float], Problem]]:
        """Return start and stop (SI), what is declared about the parameter, and the problem at each value of it."""
        if isinstance(self.zc, Span):
            return self.zc.start, self.zc.stop, Span.quantities()["start"], lambda value: problem
        if case is None or self.parameter is None:
            raise ParameterError("only a whole case has parameters to vary; run this with dforce.run")
        whole, path = case, self.parameter
        quantity = whole.quantity(path)
        start, stop = (_parsed(key, getattr(self, key), quantity.unit) for key in ("start", "stop"))
        if start == stop:
            raise ParameterError(f"the range of {path} starts where it stops; give two values")
        for end in (start, stop):
            whole.replace(path, end)  # refuses a value that is not allowed
        frequency = FREQUENCY.fullmatch(path)
        if frequency:
            tone = int(frequency[1] or 1) - 1
            there = problem.at_height(self.zc)
            return start, stop, quantity, lambda value: there.at_frequency(value, tone)
        return start, stop, quantity, lambda value: whole.replace(path, value).problem

    def _dataset(
        self, among: ParameterRange, curves: list[Curve], quantity: ParameterQuantity, searched: Array
    ) -> xr.Dataset:
        from dforce.experiments.motion import base_of, rows_of, scales_of, with_motions
        from dforce.experiments.table import Table, with_levers
        from dforce.results.dataset import describe
        from dforce.solvers.escape import UnstableStates, escape
        from dforce.solvers.search import index_sum, why_unproven

        orbits = [(number, orbit) for number, curve in enumerate(curves, start=1) for orbit in curve.points]
        table = Table(("point",), {"point": np.arange(1, len(orbits) + 1)}, among.problem, self.harmonics)
        problems = [among.problem_at(orbit.value) for _, orbit in orbits]
        for i, ((_, orbit), problem) in enumerate(zip(orbits, problems, strict=True)):
            table.put((i,), among.steady(orbit), problem)
        data = table.dataset()
        if orbits:
            bases = [base_of(problem) * scales_of(problem) for problem in problems]
            kept = [
                rows_of(orbit.kept, np.ones(1), base, among.problem)
                for (_, orbit), base in zip(orbits, bases, strict=True)
            ]
            rows = np.concatenate(kept)
            data = with_motions(data, ("point",), rows, among.problem)
        if among.has_changing_lever:
            data = with_levers(data, "point", problems)
        unstable = UnstableStates(curves, among)
        escapes = [escape(orbit, unstable, problem) for (_, orbit), problem in zip(orbits, problems, strict=True)]
        data["escape"] = ("point", np.array(escapes, dtype=float))
        name = self._name()
        data.coords[name] = ("point", np.array([orbit.value for _, orbit in orbits], dtype=float))
        data.coords["branch"] = ("point", np.array([number for number, _ in orbits], dtype=int))
        data["stable"] = ("point", np.array([orbit.is_stable for _, orbit in orbits], dtype=bool))
        data["special"] = ("point", np.array([orbit.special for _, orbit in orbits], dtype=np.str_))
        repeats = [orbit.repeats * among.common for _, orbit in orbits]
        data[REPEATS] = ("point", np.array(repeats, dtype=int))
        sums = [index_sum(curves, value / among.span) for value in searched]
        if sums:
            data.coords["searched"] = ("search", searched)
            data["searched"].attrs["units"] = quantity.unit
            data["index_sum"] = ("search", np.array(sums, dtype=int))
        if isinstance(self.zc, float):
            data.coords["zc"] = self.zc
            words = {"units": quantity.unit, "long_name": quantity.doc, "symbol": quantity.symbol}
            data[name].attrs.update({key: word for key, word in words.items() if word})
        unproven, is_full = why_unproven(among.problem), len(orbits) >= self.max_points - 1
        data.attrs |= {
            "along": name,
            "samples_per_period": among.points,
            "completeness": _completeness(sums, unproven, is_full),
        }
        return describe(data)


def _completeness(sums: list[int], unproven: str, is_full: bool) -> str:
    """Return in a sentence whether the indices of the states say that none is missing."""
    if not sums:
        return "not checked: search = 0"
    if unproven:
        return f"not proven: {unproven}, so that the indices of the states need not add up to 1"
    missing = sum(one != 1 for one in sums)
    if missing:
        limit = "; max_points is reached" if is_full else ""
        return (
            f"states are missing: their indices do not add up to 1 at {missing} of {len(sums)} searched values{limit}"
        )
    return "no single state is missing: their indices add up to 1 at all searched values"


def _parsed(key: str, given: Any, unit: str) -> float:
    try:
        return units.parse(given, unit)
    except UnitError as error:
        raise UnitError(f"experiment.{key} {error}") from None
