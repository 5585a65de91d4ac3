"""Looks through a netCDF file of unknown origin; run as a process of its own, which may fail without harm.

HDF5 files may point to other files, hold data that unpack to any size, or be broken so that its library crashes. The
process reads everything there is, within limits, before the server opens the file: ``python inspection.py FILE BYTES``
ends with 0, or says in a sentence on stdout what is wrong.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import h5py

MOST_MEMORY = 4_000_000_000  # bytes of the process
MOST_SECONDS = 20  # of computing
MOST_MEMBERS = 500
PLAIN = "fiubSO"  # kinds of numbers and texts
COMPRESSIONS = (None, "gzip", "lzf")


def problem_of(path: Path, most_bytes: int) -> str:
    """Return what is wrong with a file, empty when nothing is."""
    import h5py

    with h5py.File(path, "r") as file:
        if len(file) > MOST_MEMBERS:
            return f"it holds {len(file)} members; a result has fewer than {MOST_MEMBERS}"
        total = 0
        for name in file:
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):
                return "it points to other files or places, which no result does"
            member = file[name]
            if not isinstance(member, h5py.Dataset):
                return "it holds groups, which no result does"
            wrong = _wrong_with(member)
            if wrong:
                return wrong
            total += member.nbytes
            if total > most_bytes:
                return f"it unpacks to more than {most_bytes // 1_000_000} MB"
        for data in _everything(file):
            del data
    return ""


def _wrong_with(member: h5py.Dataset) -> str:
    if member.is_virtual or member.external:
        return "it takes data from other files, which no result does"
    if member.dtype.kind not in PLAIN or (member.dtype.kind == "O" and not _is_text(member.dtype)):
        return "it holds data that are neither numbers nor text"
    if member.compression not in COMPRESSIONS:
        return "it is packed in a way that no result is"
    return ""


def _is_text(dtype: Any) -> bool:
    import h5py

    return h5py.check_string_dtype(dtype) is not None


def _everything(file: h5py.File) -> Iterator[Any]:
    """Read all data and attributes, so that what is broken breaks here."""
    yield dict(file.attrs)
    for name in file:
        yield file[name][()]
        yield dict(file[name].attrs)


def main(path: str, most_bytes: str) -> int:
    """Look through a file; the exit code is 1 when something is wrong."""
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))
    except (ImportError, ValueError, OSError):  # Windows has no such limits
        pass
    wrong = problem_of(Path(path), int(most_bytes))
    print(wrong)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
