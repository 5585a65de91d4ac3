"""Projects: a document with all its results in one file, a zip archive of netCDF files; whole or not at all."""

from __future__ import annotations

import dataclasses
import io
import json
import tempfile
import zipfile
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import dforce as df
from dforce.gui.document.document import PLUGINS, Document
from dforce.gui.document.store import IDENTIFIER, ResultStore
from dforce.gui.files.uploads import MOST_BYTES, beside_from, opened_from, result_from
from dforce.gui.study import explore, pictures
from dforce.gui.study.explore import is_explorable
from dforce.gui.study.parameter_study import Over

if TYPE_CHECKING:
    import xarray as xr

DOCUMENT, OVER, REGIMES = "document.json", "over.nc", "regimes.nc"
FORMAT = 1
LONGEST_DOCUMENT = 5_000_000  # bytes
BROKEN = "this project is damaged or was cut short"


class Project(NamedTuple):
    """A project: its document, by identifier its results, measured curve and fit, and a result over parameters."""

    document: Document
    results: dict[str, xr.Dataset]
    over: Over | None


def has_room(over: Over) -> bool:
    """Return whether a result over parameters is small enough to be kept with a project."""
    return bool(over.result.nbytes <= MOST_BYTES)


def packed(document: Document, results: ResultStore, measured: ResultStore, over: Over | None = None) -> bytes:
    """Return the file of a project. Blocking.

    Parameters
    ----------
    document, results
        The document, and its results.
    measured
        Its measured curve and the fit.
    over
        A result over parameters; a result that is too large, such as a store, is left out (:func:`has_room`).

    Raises
    ------
    ResultError
        When a result is missing, or the file would be too large to be opened again.
    """
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        plain: dict[str, Any] = {"format": FORMAT, "document": document.to_plain()}
        if over is not None and has_room(over):
            plain["over"] = {"origin": over.origin()}
            with tempfile.TemporaryDirectory(prefix="dforce-") as place:
                archive.write(df.write(over.result, Path(place) / OVER), OVER)
                if over.regimes is not None:
                    plain["over"]["regimes"] = True
                    archive.write(df.write(over.regimes, Path(place) / REGIMES), REGIMES)
        archive.writestr(DOCUMENT, json.dumps(plain, indent=1))
        for kept in document.results:
            archive.write(results.path(kept.id), f"{kept.id}.nc")
        for identifier in beside(document):
            archive.write(measured.path(identifier), f"{identifier}.nc")
    if stream.tell() > MOST_BYTES:
        raise df.ResultError(
            f"the project has {stream.tell() // 1_000_000} MB; at most {MOST_BYTES // 1_000_000} MB can be opened "
            "again, so remove some results first"
        )
    return stream.getvalue()


def unpacked(data: bytes, folder: Path) -> Project:
    """Return the contents of a project file. Blocking.

    Raises
    ------
    ResultError, CaseError, ParameterError
        With one sentence, when anything in it is wrong.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            plain = json.loads(_entry(archive, DOCUMENT, LONGEST_DOCUMENT))
            if not isinstance(plain, dict) or plain.get("format") != FORMAT:
                raise df.ResultError("this project is from another version of dForce")
            document = _document(plain["document"])
            files = {}
            left = 4 * MOST_BYTES
            for identifier in [*(kept.id for kept in document.results), *beside(document)]:
                if not IDENTIFIER.fullmatch(identifier):
                    raise df.ResultError(BROKEN)
                files[identifier] = _entry(archive, f"{identifier}.nc", min(left, MOST_BYTES))
                left -= len(files[identifier])
            told = plain.get("over")
            over = None if told is None else _entry(archive, OVER, min(left, MOST_BYTES))
            has_regimes = isinstance(told, dict) and bool(told.get("regimes"))
            regimes = _entry(archive, REGIMES, min(left, MOST_BYTES)) if has_regimes else None
    except (
        zipfile.BadZipFile,
        KeyError,
        ValueError,
        EOFError,
        RuntimeError,  # a password, a method of packing that is not known, tables nested too deeply
        zlib.error,
        OSError,
    ) as error:
        if isinstance(error, df.DForceError):
            raise
        raise df.ResultError(BROKEN) from None
    own = set(beside(document))
    results = {
        identifier: beside_from(file, folder) if identifier in own else result_from(file, folder, document.plots)
        for identifier, file in files.items()
    }
    if over is None:
        return Project(document, results, None)
    found = _over(opened_from(over, folder), told.get("origin") if isinstance(told, dict) else None)
    if regimes is not None:
        found = _with_regimes(found, opened_from(regimes, folder))
    return Project(document, results, found)


def _over(result: xr.Dataset, origin: object) -> Over:
    """Return the result over parameters of a project.

    Raises
    ------
    ResultError
        When it is no such result.
    """
    try:
        found = Over.of(result, origin)
    except df.CaseError:
        raise df.ResultError(BROKEN) from None
    if not is_explorable(result):
        raise df.ResultError(BROKEN)
    return found


def _with_regimes(over: Over, regimes: xr.Dataset) -> Over:
    """Return a result over parameters with the map of regimes over it.

    Raises
    ------
    ResultError
        When it is no such map.
    """
    try:
        pictures.figure(over.result, explore.fitting(over.result, explore.Choice()), regimes=regimes)
    except Exception as error:  # no fault of the file may reach the page
        raise df.ResultError(BROKEN) from error
    return dataclasses.replace(over, regimes=regimes)


def beside(document: Document) -> list[str]:
    """Return the identifiers of the measured curve of a document and of its fit, as far as there are such."""
    measured = document.measured
    return [] if measured is None else [measured.id, *([measured.fit] if measured.fit else [])]


def _document(plain: object) -> Document:
    """Return the document of a project.

    Raises
    ------
    ResultError, ParameterError
        When it is none, or names Python files.
    """
    try:
        document = Document.from_plain(plain)
    except df.CaseError:
        raise df.ResultError(BROKEN) from None
    if "plugins" in document.table:
        raise df.ParameterError(PLUGINS)
    return document


def _entry(archive: zipfile.ZipFile, name: str, most: int) -> bytes:
    """Return the entry of a name in an archive, if it is no longer than allowed."""
    with archive.open(name) as stream:
        data = stream.read(most + 1)
    if len(data) > most:
        raise df.ResultError("this project unpacks to too much")
    return data
