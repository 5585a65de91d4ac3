"""The measured curve of a session: read, calibrated for the case that is typed, and fitted."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import dforce as df
from dforce.core.progress import duration
from dforce.gui.document.compute import Job
from dforce.gui.document.document import LONGEST_FILE, Document, MeasuredData
from dforce.gui.document.store import ResultStore
from dforce.gui.measured.reading import CALIBRATED, calibrated
from dforce.inverse.fitting.result import data_of
from dforce.results.provenance import provenance

if TYPE_CHECKING:
    import xarray as xr

    from dforce.gui.measured.fitting import SafeJob

INSTRUMENT = ("cantilever", "drive", "medium", "readout")  # sections that a calibration depends on


class MeasuredSession:
    """Holds the measured curve that the document names.

    Parameters
    ----------
    folder
        Where curve and fit are kept; it is made when the first one comes.

    Attributes
    ----------
    curve
        The calibrated curve; None while there is none.
    fit
        Its last fit.
    wrong
        Why there is no curve although the document names one.
    safe, force
        The last safe settings, and the last reconstruction; both go on, and stay, when a page is loaded anew.
    """

    def __init__(self, folder: Path) -> None:
        self.results = ResultStore(folder)
        self.curve: xr.Dataset | None = None
        self.fit: xr.Dataset | None = None
        self.wrong = ""
        self.safe: SafeJob | None = None
        self.force: ReconstructJob | None = None
        self._loaded: Any = None
        self._loading = asyncio.Lock()

    def stop(self) -> None:
        """Stop the safe settings and the reconstruction."""
        for job in (self.safe, self.force):
            if job is not None:
                job.stopping.set()

    async def load(self, document: Document) -> xr.Dataset | None:
        """Have the document's curve and fit in memory, calibrated for its instrument, and return the curve."""
        async with self._loading:
            await self._load(document)
            return self.curve

    async def _load(self, document: Document) -> None:
        measured = document.measured
        instrument = [document.value((name,)) for name in INSTRUMENT]
        wanted = None if measured is None else (measured.id, measured.fit, measured.settings, instrument)
        if wanted == self._loaded:
            return
        if measured is None:
            self.curve, self.fit, self.wrong = None, None, ""
        else:
            self.curve, self.fit, self.wrong = await asyncio.to_thread(self._take, measured, document)
        self._loaded = wanted  # only now: a page that is closed meanwhile ends the loading

    def _take(self, measured: MeasuredData, document: Document) -> tuple[xr.Dataset | None, xr.Dataset | None, str]:
        """Return the curve, calibrated, its fit, and an error. Blocking."""
        case: df.Case | None = None
        with contextlib.suppress(df.DForceError, TypeError):  # a case that is being typed
            case = document.case()
        fit = None
        try:
            curve = calibrated(self.results.take(measured.id), measured.settings, case)
        except df.DForceError as error:
            return None, None, str(error)
        with contextlib.suppress(df.ResultError):  # a fit that has gone can be done again
            fit = self.results.take(measured.fit) if measured.fit else None
        return curve, fit, ""

    async def keep(self, raw: xr.Dataset, name: str, settings: Mapping[str, object]) -> MeasuredData:
        """Keep a curve that was read, and return its entry for a document.

        Raises
        ------
        ResultError
            When it cannot be written.
        """

        def shelve() -> tuple[str, float]:
            return self.results.keep(raw), calibrated(raw, settings, None).attrs.get("height_offset", 0.0)

        identifier, offset = await asyncio.to_thread(shelve)
        return MeasuredData(identifier, name[-LONGEST_FILE:], dict(settings), float(offset))

    async def tidy(self, document: Document, steps: Sequence[Document]) -> None:
        """Remove files of curves and fits, except of the document, and of other cases to which undo or redo leads back.

        `steps` are the documents of undo and redo in order, with this document between them.
        """
        others = (pair for pair in itertools.pairwise(steps) if pair[0].opened is not pair[1].opened)
        found = [one.measured for one in (document, *itertools.chain(*others)) if one.measured is not None]
        named = {name for one in found for name in (one.id, one.fit)}

        def remove() -> None:
            for name in set(self.results.names()) - named:
                with contextlib.suppress(df.ResultError):  # another page was quicker
                    self.results.drop(name)

        await asyncio.to_thread(remove)


@dataclass
class FitJob(Job):
    """A running fit."""

    data: xr.Dataset | None = None
    told: bool = False  # to stop, which is said once: later messages describe the best so far

    def compute(self) -> xr.Dataset:
        """Fit; when it is stopped, the best so far."""
        return df.fit(self.case, self.data, progress=self._watch)

    def _watch(self, done: int, total: int, note: str) -> None:
        if self.told:
            return
        try:
            super()._watch(done, total, note)
        except KeyboardInterrupt:
            self.told = True
            raise

    def words(self) -> str:
        """Return the progress in words."""
        if self.state == "running":
            left = self.time_left()
            return self.note.replace("chi2", "χ² =") + (f", about {duration(left)} left" if left is not None else "")
        if self.state == "stopped" and not self.error:
            return "stopped"
        return super().words() if self.state == "queued" else ""


@dataclass
class ReconstructJob(Job):
    """A running reconstruction, of a curve whose heights are average distances."""

    curve: xr.Dataset | None = None
    of: object = None  # of which curve and lever it is
    holds_for: str = ""

    def compute(self) -> xr.Dataset:
        """Reconstruct the force."""
        if self.curve is None:
            raise df.ParameterError("there is no measured curve")
        return df.reconstruct(self.curve, self.case, progress=self._watch)


def curve_in(fit: xr.Dataset) -> tuple[xr.Dataset, str, dict[str, Any]]:
    """Return the measured curve of a fit with its calibration, its name, and no settings."""
    curve = data_of(fit)
    if "direction" not in curve.coords:
        curve = curve.assign_coords(direction=("point", ["approach"] * curve.sizes["point"]))
    curve = curve.assign_attrs(provenance("", "") | {"phase_convention": "lag", CALIBRATED: 0.0} | curve.attrs)
    return curve, str(curve.attrs.get("source", "the fitted curve")), {}
