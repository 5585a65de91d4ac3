"""What a session looks at over parameters: a plan or a sweep that was opened, or one that is computed here."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Self

import dforce as df
from dforce.gui.case.parameters import ParameterRow, rows_of
from dforce.gui.document.compute import Job
from dforce.gui.document.document import Document

if TYPE_CHECKING:
    from collections.abc import Callable

    import xarray as xr

SECTIONS = ("drive", "sample", "contact", "tip", "medium", "cantilever")  # whose parameters a result may go along
MOST_VALUES = 101  # of a parameter
FIRST_AMPLITUDE = ("drive.A0", "drive.tones.1.A0")  # distances follow it
LOGARITHMIC = 5.0  # ratio of the ends of a range from which on its values go by equal factors


@dataclass
class SweepJob(Job):
    """States at the set point for values of a parameter, under way."""

    over: dict[str, Any] = field(default_factory=dict)
    share: float = 0.8

    def compute(self) -> xr.Dataset:
        """Sweep; when it is stopped, what there is of it."""
        return df.sweep(self.case, over=self.over, at_set_point=self.share, progress=self._watch)


@dataclass(frozen=True)
class Over:
    """A result over parameters, with the parameter along which the window computed it, and of which document."""

    result: xr.Dataset
    row: ParameterRow | None = None
    document: Document | None = None

    def origin(self) -> dict[str, Any] | None:
        """Return row and document as data that JSON can hold; None for a result that was opened."""
        if self.row is None or self.document is None:
            return None
        return {"row": self.row.name, "document": self.document.to_plain()}

    @classmethod
    def of(cls, result: xr.Dataset, origin: object) -> Self:
        """Return a result with what :meth:`origin` gave.

        Raises
        ------
        CaseError
            When the document is none.
        """
        if not isinstance(origin, dict):
            return cls(result)
        document = Document.from_plain(origin.get("document"))
        row = next((row for row in rows_of(document, SECTIONS) if row.name == origin.get("row")), None)
        return cls(result, row, document)


class ParameterStudy:
    """A result over parameters.

    Attributes
    ----------
    result
        The result; None while there is none.
    row, document
        The parameter along which it was computed here, and of which document.
    job
        The last computation.
    number
        Counts the results, so that pages see that there is another one.
    """

    def __init__(self) -> None:
        self.result: xr.Dataset | None = None
        self.row: ParameterRow | None = None
        self.document: Document | None = None
        self.job: SweepJob | None = None
        self.number = 0

    @property
    def busy(self) -> bool:
        """Whether something is computed."""
        return self.job is not None and self.job.busy

    def over(self) -> Over | None:
        """Return the result with where it came from; None while there is none."""
        return None if self.result is None else Over(self.result, self.row, self.document)

    def take(self, result: xr.Dataset, row: ParameterRow | None = None, document: Document | None = None) -> None:
        """Look at a result."""
        self.result, self.row, self.document = result, row, document
        self.number += 1

    async def compute(self, job: SweepJob, row: ParameterRow, look: Callable[[], None], every: float) -> None:
        """Compute states along a parameter, and look at them; those of one that is stopped, too."""
        self.job = job
        await job.go(look, every)
        if job.result is not None and job is self.job and job.document is not None:
            self.take(job.result, row, job.document)
        look()

    def stop(self) -> None:
        """Stop the computation under way; what it has is kept."""
        if self.job is not None:
            self.job.stopping.set()

    def is_of(self, document: Document) -> bool:
        """Return whether what was computed here is of the case of a document, whatever the parameter is there."""
        if self.document is None or self.row is None:
            return True
        return self.document.put(self.row.path, None).same_case(document.put(self.row.path, None))


def sweep_job(document: Document, case: df.Case, row: ParameterRow, ends: tuple[str, str], points: int) -> SweepJob:
    """Return the job that computes the states at a document's set point along a parameter.

    Raises
    ------
    ParameterError
        When the ends are no values of the parameter, or the number of values is too large or too small.
    """
    if not 2 <= points <= MOST_VALUES:
        raise df.ParameterError(f"{points} values are not between 2 and {MOST_VALUES}")
    unit = case.quantity(row.name).unit
    low, high = (df.parse(end, unit) for end in ends)
    if not low < high:
        raise df.ParameterError(f"the range from {ends[0]} to {ends[1]} does not rise")
    ratio = high / low if low > 0.0 else 0.0
    spacing = "log" if ratio >= LOGARITHMIC else "linear"
    if not isinstance(case.experiment, df.experiments.Approach):
        case = with_approach(case.replace(experiment=None))
    if row.name in FIRST_AMPLITUDE:
        case = _following(case)
    over = {row.name: {"start": low, "stop": high, "points": points, "spacing": spacing}}
    return SweepJob(case, document=document, over=over, share=document.set_point)


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
