"""Files that come from outside: what they are, and what is in them, once they have been looked through."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import dforce as df
from dforce.core.files import in_quotes
from dforce.core.toml import LONGEST, read_toml
from dforce.gui.document.document import PLUGINS, Document
from dforce.gui.document.store import why
from dforce.gui.files.upload_checks import validate_measured, validate_study, validate_upload
from dforce.gui.study.explore import is_explorable
from dforce.inverse.readers import endings
from dforce.results import hdf5
from dforce.results.curves import Picture
from dforce.results.kinds import is_kind

if TYPE_CHECKING:
    import xarray as xr

Kind = Literal["case", "result", "project", "measured"]

MOST_BYTES = 50_000_000  # of a file
ZIP = b"PK\x03\x04"


def kind_of(data: bytes, name: str = "") -> Kind:
    """Return what a file is by its content; where that may be a measured curve as well, by the ending of its name."""
    may_be_measured = name.lower().endswith(endings())
    if data.startswith(hdf5.START):
        return "measured" if may_be_measured else "result"
    if data.startswith(ZIP):
        return "project"
    return "measured" if may_be_measured and not _is_toml(data) else "case"


def _is_toml(data: bytes) -> bool:
    try:
        return len(data) <= LONGEST and bool(read_toml(data.decode("utf-8-sig")))
    except ValueError:
        return False


def document_from(data: bytes) -> Document:
    """Return the document of a case file.

    Raises
    ------
    CaseError, ParameterError
        When it is none.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise df.CaseError("this is not a case, result or project of dForce") from None
    return Document.of(case_of(text))


def case_of(text: str) -> df.Case:
    """Return the case of a TOML text; no Python file that it names is run.

    Raises
    ------
    CaseError, ParameterError
        When it is none.
    """
    try:
        table = read_toml(text)
    except ValueError:
        table = {}  # the sentence comes from dForce
    if "plugins" in table:
        raise df.ParameterError(PLUGINS)
    return df.Case.from_toml(text)


def result_from(data: bytes, folder: Path, pictures: Sequence[Picture] = ()) -> xr.Dataset:
    """Return the result in the bytes of a netCDF file. Blocking.

    Parameters
    ----------
    data
        The file.
    folder
        Where it may lie while it is read.
    pictures
        What is going to be drawn of it, beside what suits it.

    Raises
    ------
    ResultError
        When it is none, points to other files, unpacks to too much, or cannot be written again and drawn; and when it finds
        no room in the folder.
    """
    with _looked_through(data, folder) as path:
        result = _result(path)
        validate_upload(result, path.parent, pictures)
    return result


def opened_from(data: bytes, folder: Path) -> xr.Dataset:
    """Return what is in the bytes of a netCDF file: a result, one over parameters, a measured curve or a fit. Blocking.

    Raises
    ------
    ResultError
        As :func:`result_from`.
    """
    with _looked_through(data, folder) as path:
        result = _read(path)
        if is_kind(result, "measured", "fit"):
            validate_measured(result)
        elif is_explorable(result):
            validate_study(_result(path))
        else:
            validate_upload(_result(path), path.parent)
    return result


def beside_from(data: bytes, folder: Path) -> xr.Dataset:
    """Return the measured curve, or the fit of one, in the bytes of a netCDF file. Blocking.

    Raises
    ------
    ResultError
        As :func:`result_from`.
    """
    with _looked_through(data, folder) as path:
        result = _read(path)
        validate_measured(result)
    return result


@contextlib.contextmanager
def _looked_through(data: bytes, folder: Path) -> Iterator[Path]:
    """Give a file with bytes that are safe to be read.

    Raises
    ------
    ResultError
        When they are not, or there is no room for them.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix="upload-") as place:
            path = Path(place) / "result.nc"
            path.write_bytes(data)
            hdf5.look(data, "result")
            yield path
    except OSError as error:
        if isinstance(error, df.DForceError) and not isinstance(error.__cause__, OSError):
            raise
        raise df.ResultError(f"this file cannot be checked here: {why(error)}") from error


def _read(path: Path) -> xr.Dataset:
    try:
        return df.read(path)
    except df.ResultError as error:
        raise df.ResultError(str(error).replace(in_quotes(path), "this file")) from None


def _result(path: Path) -> xr.Dataset:
    result = _read(path)
    try:
        case_of(str(result.attrs.get("case", "")))
    except df.DForceError as error:
        raise df.ResultError(f"the case of this result cannot be used here: {error}") from None
    if "status" not in result and not is_kind(result, "reconstruction", "regimes"):
        raise df.ResultError("this is not the result of an experiment")
    return result
