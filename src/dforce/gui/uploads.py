"""Files that come from outside: what they are, and what is in them, once they have been looked through."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import dforce as df
from dforce.core.errors import shorten
from dforce.gui import inspection
from dforce.gui.document import PLUGINS, Document
from dforce.gui.rehearsal import rehearse
from dforce.gui.store import why
from dforce.results.curves import Picture

if TYPE_CHECKING:
    import xarray as xr

Kind = Literal["case", "result", "project"]

MOST_BYTES = 50_000_000  # of a file
MOST_UNPACKED = 200_000_000  # of the data in a result
SECONDS = 40.0  # that looking through one may take
HDF5, ZIP = b"\x89HDF\r\n\x1a\n", b"PK\x03\x04"


def kind_of(data: bytes) -> Kind:
    """Return what a file is by its content; its name says nothing."""
    if data.startswith(HDF5):
        return "result"
    return "project" if data.startswith(ZIP) else "case"


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
        raise df.CaseError("this is no case, result or project of dForce") from None
    return Document.of(case_of(text))


def case_of(text: str) -> df.Case:
    """Return the case of a TOML text; no Python file that it names is run.

    Raises
    ------
    CaseError, ParameterError
        When it is none.
    """
    try:
        table = tomllib.loads(text[: 2 * MOST_BYTES])
    except (ValueError, RecursionError):
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
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix="upload-") as place:
            path = Path(place) / "result.nc"
            path.write_bytes(data)
            _inspect(path)
            result = _result(path)
            rehearse(result, path.parent, pictures)
    except OSError as error:
        if isinstance(error, df.DForceError) and not isinstance(error.__cause__, OSError):
            raise
        raise df.ResultError(f"there is no place here to look at this file: {why(error)}") from error
    return result


def _result(path: Path) -> xr.Dataset:
    try:
        result = df.read(path)
    except df.ResultError as error:
        raise df.ResultError(str(error).replace(f"'{shorten(str(path))}'", "this file")) from None
    try:
        case_of(str(result.attrs.get("case", "")))
    except df.DForceError as error:
        raise df.ResultError(f"the case of this result cannot be used here: {error}") from None
    if "status" not in result:
        raise df.ResultError("this is not the result of an experiment")
    return result


def _inspect(path: Path) -> None:
    command = [sys.executable, "-I", inspection.__file__, str(path), str(MOST_UNPACKED)]
    try:
        found = subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=SECONDS,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise df.ResultError("this file takes too long to read, so it is not opened") from None
    wrong = found.stdout.decode("utf-8", "replace").strip()
    if wrong:
        raise df.ResultError(f"this file is not opened: {shorten(wrong, 200)}")
    if found.returncode:
        raise df.ResultError("this file is damaged or was cut short")
