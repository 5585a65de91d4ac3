"""Readers of files of measured curves: one file, one format. Each gives tables as they are written."""

from __future__ import annotations

import os
from pathlib import Path

from dforce.errors import ResultError, shorten
from dforce.files import reason
from dforce.inverse.readers import hdf5, igor, nanosurf, text
from dforce.inverse.table import Table

HDF5 = b"\x89HDF\r\n\x1a\n"
MOST_BYTES = 1_000_000_000
NOT_READ = (
    (b"\\*File list", "is a file of Bruker's NanoScope; export the curve as text (ASCII)"),
    (b"\\*Force file list", "is a file of Bruker's NanoScope; export the curve as text (ASCII)"),
    (b"PK\x03\x04", "is an archive, as JPK writes them; export the curve as text (ASCII)"),
    (b"CDF", "is netCDF of the older kind (3), which is not read"),
)  # how files begin that need another program first


def content_of(path: str | os.PathLike[str]) -> tuple[bytes, str]:
    """Return the bytes of a file, and its name for a sentence.

    Raises
    ------
    ResultError
        When it cannot be read, or is empty.
    """
    name = f"'{shorten(str(path))}'"
    try:
        if Path(path).stat().st_size > MOST_BYTES:
            raise ResultError(f"{name} is larger than {MOST_BYTES // 1_000_000_000} GB, which is no file of curves")
        content = Path(path).read_bytes()
    except FileNotFoundError:
        raise ResultError(f"there is no file {name}") from None
    except ResultError:
        raise
    except (OSError, ValueError) as error:
        raise ResultError(f"{name} cannot be read: {reason(error)}") from None
    if not content.strip():
        raise ResultError(f"{name} is empty")
    return content, name


def tables_in(content: bytes, name: str) -> list[Table]:
    """Return the curves in a file, by what it holds, whatever its name ends in.

    Raises
    ------
    ResultError
        For a file that cannot be read, with what to do instead where that is known.
    """
    for start, sentence in NOT_READ:
        if content.startswith(start):
            raise ResultError(f"{name} {sentence}")
    if content.startswith(HDF5):
        return hdf5.read(content, name)
    if igor.is_igor(content):
        return igor.read(content, name)
    if nanosurf.is_nanosurf(content):
        return nanosurf.read(content, name)
    return text.read(content, name)
