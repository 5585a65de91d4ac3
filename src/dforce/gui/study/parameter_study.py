"""The result over parameters that a session shows: a plan or a sweep that was opened, or one computed here."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Self

import dforce as df
from dforce.gui.case.values import ParameterRow, composed, rows_of, taken_apart
from dforce.gui.document.compute import Job
from dforce.gui.document.document import Document

if TYPE_CHECKING:
    from collections.abc import Callable

    import xarray as xr

SECTIONS = ("drive", "sample", "contact", "tip", "medium", "cantilever")  # whose parameters a result may go along
MOST_VALUES = 101  # of a parameter
MOST_SETTINGS = 2000  # of a map
SET_POINT = "set_point"
FIRST_AMPLITUDE = ("drive.A0", "drive.tones.1.A0")  # distances follow it
LOGARITHMIC = 5.0  # ratio of the ends of a range from which on its values go by equal factors


@dataclass
class SweepJob(Job):
    """A computation of states at the set point for values of a parameter."""

    over: dict[str, Any] = field(default_factory=dict)
    share: float = 0.8

    def compute(self) -> xr.Dataset:
        """Sweep, up to a stop."""
        return df.sweep(self.case, over=self.over, at_set_point=self.share, progress=self._watch)


@dataclass
class PlanJob(Job):
    """A computation of all states at set points over one or two parameters, and of the limits that they keep.

    Attributes
    ----------
    set_points, limits
        Arguments of :func:`dforce.plan`.
    plan
        The plan, before the boundaries of regimes are followed.
    regimes
        The map of regimes, where two parameters make a map.
    """

    over: dict[str, Any] = field(default_factory=dict)
    set_points: Any = None
    limits: dict[str, str] = field(default_factory=dict)
    plan: xr.Dataset | None = None
    regimes: xr.Dataset | None = None

    def compute(self) -> xr.Dataset:
        """Plan, and follow the boundaries of regimes; a plan that is stopped has its states."""
        plan = df.plan(self.case, self.over, self.set_points, self.limits, progress=self._watch)
        several = [dim for dim in plan["allowed"].dims if dim != "state" and plan.sizes[dim] > 1]
        if len(several) == 2 and not plan.attrs.get("interrupted"):
            self.plan = plan
            over = {path: values for path, values in self.over.items() if not isinstance(values, list)}
            try:
                self.regimes = df.regimes(self.case, over, self.set_points, progress=self._watch)
            except df.ParameterError as error:  # such as a map over contact.a0; the plan itself is whole
                plan.attrs["findings"] += f"\nThe boundaries of the regimes are not drawn: {error}."
        return plan


@dataclass(frozen=True)
class Over:
    """A result over parameters, with the parameters along which the window computed it, and of which document."""

    result: xr.Dataset
    row: ParameterRow | None = None
    document: Document | None = None
    second: ParameterRow | None = None
    regimes: xr.Dataset | None = None

    def origin(self) -> dict[str, Any] | None:
        """Return rows and document as data that JSON can hold; None for a result that was opened."""
        if self.row is None or self.document is None:
            return None
        second = "" if self.second is None else self.second.name
        return {"row": self.row.name, "second": second, "document": self.document.to_plain()}

    @classmethod
    def of(cls, result: xr.Dataset, origin: object) -> Self:
        """Return a result with the data of :meth:`origin`.

        Raises
        ------
        CaseError
            When the data are not a document.
        """
        if not isinstance(origin, dict):
            return cls(result)
        document = Document.from_plain(origin.get("document"))
        rows = {row.name: row for row in choices(document)}
        return cls(result, rows.get(str(origin.get("row"))), document, rows.get(str(origin.get("second"))))


class ParameterStudy:
    """A result over parameters.

    Attributes
    ----------
    over
        The result, with where it came from; None while there is none.
    job
        The last computation.
    number
        Counts the results, so that pages see that there is another one.
    """

    def __init__(self) -> None:
        self.over: Over | None = None
        self.job: SweepJob | PlanJob | None = None
        self.number = 0

    @property
    def result(self) -> xr.Dataset | None:
        """The result; None while there is none."""
        return None if self.over is None else self.over.result

    @property
    def busy(self) -> bool:
        """Whether something is computed."""
        return self.job is not None and self.job.busy

    def open(self, over: Over) -> None:
        """Look at a result that was opened; a running computation ends, and does not replace it."""
        self.stop()
        self.job = None
        self.take(over)

    def take(self, over: Over) -> None:
        """Look at a result."""
        self.over = over
        self.number += 1

    async def compute(
        self,
        job: SweepJob | PlanJob,
        rows: tuple[ParameterRow, ParameterRow | None],
        look: Callable[[], None],
        every: float,
    ) -> None:
        """Compute states along parameters, and look at them, even after a stop.

        Nothing is computed while another computation runs.
        """
        if self.busy:  # it was asked for twice
            return
        self.job = job

        def looked() -> None:
            """Show a plan before the boundaries of its regimes are there."""
            if isinstance(job, PlanJob) and job.plan is not None and self.result is not job.plan and job is self.job:
                self.take(Over(job.plan, rows[0], job.document, rows[1]))
            look()

        await job.go(looked, every)
        if job.result is not None and job is self.job:
            regimes = job.regimes if isinstance(job, PlanJob) else None
            self.take(Over(job.result, rows[0], job.document, rows[1], regimes))
        look()

    def stop(self) -> None:
        """Stop the current computation; its finished part is kept."""
        if self.job is not None:
            self.job.stopping.set()

    def why_behind(self, document: Document) -> str:
        """Return why the result does not belong to a document with any values of its parameters; empty where it does."""
        over = self.over
        if over is None or over.document is None or over.row is None:
            return ""
        mine = over.document
        for row in (over.row, over.second):
            if row is not None and row.name != SET_POINT:
                mine, document = mine.put(row.path, None), document.put(row.path, None)
        if not mine.same_case(document):
            return "This result belongs to an earlier case; compute it again."
        if mine.set_point != document.set_point and SET_POINT not in (over.row.name, over.second and over.second.name):
            return f"This result is for the set point {share(mine.set_point)}; compute it again."
        return ""


@dataclass(frozen=True)
class Varied:
    """A parameter that is varied: its row, the ends of its range as typed (in its unit), and the number of values."""

    row: ParameterRow
    low: str
    high: str
    points: int

    def grid(self, unit: str) -> dict[str, Any]:
        """Return the values as a range (SI).

        Raises
        ------
        ParameterError
            When the ends are no values of the parameter, or the number of values is too large or too small.
        """
        if not 2 <= self.points <= MOST_VALUES:
            raise df.ParameterError(f"{self.points} values are not between 2 and {MOST_VALUES}")
        shown = unit if unit == "1" else taken_apart(self.row.value, unit)[1]
        low, high = (df.parse(composed(end, shown), unit) for end in (self.low, self.high))
        if not low < high:
            raise df.ParameterError(f"the range from {self.low} to {self.high} does not rise; exchange its ends")
        ratio = high / low if low > 0.0 else 0.0
        even = {"start": low, "stop": high, "points": self.points}
        return even if self.row.name == SET_POINT else even | {"spacing": "log" if ratio >= LOGARITHMIC else "linear"}


def choices(document: Document) -> list[ParameterRow]:
    """Return the parameters that can be varied: the set point, and the numbers of the case."""
    set_point = ParameterRow(SET_POINT, (SET_POINT,), "Set point", "A/A<sub>0</sub>", share(document.set_point))
    return [set_point, *rows_of(document, SECTIONS)]


def share(value: float) -> str:
    """Return a set point as text."""
    return f"{100.0 * value:.4g} %"


def plan_job(
    document: Document, case: df.Case, first: Varied, second: Varied | None, limits: dict[str, str]
) -> PlanJob:
    """Return the job that computes all states over one or two parameters, of which one may be the set point.

    Raises
    ------
    ParameterError
        When a range makes no sense, or there are too many settings.
    """
    varied = [one for one in (first, second) if one is not None]
    if len({one.row.name for one in varied}) < len(varied):
        raise df.ParameterError(f"{first.row.label} is varied twice; choose another second parameter")
    grids = {
        one.row.name: one.grid("1" if one.row.name == SET_POINT else case.quantity(one.row.name).unit) for one in varied
    }
    if math.prod(grid["points"] for grid in grids.values()) > MOST_SETTINGS:
        raise df.ParameterError(f"the map has more than {MOST_SETTINGS} settings; use fewer values")
    set_points = grids.pop(SET_POINT, [document.set_point])
    amplitude = FIRST_AMPLITUDE[bool(case.drive.tones)]
    over: dict[str, Any] = dict(grids) or {amplitude: [case.problem.tones[0].A0]}  # the set point alone
    return PlanJob(case, document=document, over=over, set_points=set_points, limits=limits)


def sweep_job(document: Document, case: df.Case, varied: Varied) -> SweepJob:
    """Return the job that computes the states on approach and retract at a document's set point along a parameter.

    Raises
    ------
    ParameterError
        When the range makes no sense.
    """
    row = varied.row
    grid = varied.grid(case.quantity(row.name).unit)
    if not isinstance(case.experiment, df.experiments.Approach):
        case = with_approach(case.replace(experiment=None))
    if row.name in FIRST_AMPLITUDE:
        case = _following(case)
    return SweepJob(case, document=document, over={row.name: grid}, share=document.set_point)


def _following(case: df.Case) -> df.Case:
    """Return a case whose distances are shares of the free amplitude, so that each approach begins as far away."""
    approach = case.experiment
    assert isinstance(approach, df.experiments.Approach)
    A0 = case.problem.tones[0].A0
    shares = approach.distances(A0) / A0
    grid = {"of": "drive.A0", "start": float(shares.max()), "stop": float(shares.min()), "points": len(shares)}
    return case.replace(experiment=approach.replace(zc=grid))


def with_approach(case: df.Case) -> df.Case:
    """Return a case with an approach that suits its instrument, where it has no experiment."""
    if case.experiment is not None:
        return case
    approach = df.experiments.Approach
    return case.replace(experiment=approach(**approach.suggested(case.problem)))
