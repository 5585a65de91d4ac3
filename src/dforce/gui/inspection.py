"""Looks through a netCDF file of unknown origin; run as a process of its own, which may fail without harm.

HDF5 files may point to other files, hold data that unpack to any size, or be broken so that its library crashes. The
process reads everything there is, within limits, before the server opens the file: ``python inspection.py FILE BYTES``
ends with 0, or says in a sentence on stdout what is wrong; a third argument lets the file hold groups.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import h5py

MOST_MEMORY = 4_000_000_000  # bytes of the process
MOST_SECONDS = 20  # of computing
MOST_MEMBERS = 500
PLAIN = "fiubSO"  # kinds of numbers and texts
COMPRESSIONS = (None, "gzip", "lzf")


def problem_of(path: Path, most_bytes: int, groups: bool = False) -> str:
    """Return what is wrong with a file, empty when nothing is; `groups`: whether it may hold groups, as instruments write."""
    import h5py

    with h5py.File(path, "r") as file:
        total = 0
        members = list[h5py.Dataset]()
        inside: list[h5py.Group] = [file]
        while inside:
            group = inside.pop()
            if len(members) + len(inside) + len(group) > MOST_MEMBERS:
                return f"it holds more than {MOST_MEMBERS} members; a result has fewer"
            for name in group:
                if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                    return "it points to other files or places, which no result does"
                member = group[name]
                if isinstance(member, h5py.Dataset):
                    members.append(member)
                elif groups and isinstance(member, h5py.Group):
                    inside.append(member)  # one that holds itself has more members than are allowed
                else:
                    return "it holds groups, which no result does"
        for member in members:
            wrong = _wrong_with(member)
            if wrong:
                return wrong
            total += member.nbytes
            if total > most_bytes:
                return f"it unpacks to more than {most_bytes // 1_000_000} MB"
        for member in members:  # all is read, so that what is broken breaks here
            dict(file.attrs), dict(member.parent.attrs), dict(member.attrs), member[()]
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


def main(path: str, most_bytes: str, *groups: str) -> int:
    """Look through a file; the exit code is 1 when something is wrong."""
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))
    except (ImportError, ValueError, OSError):  # Windows has no such limits
        pass
    wrong = problem_of(Path(path), int(most_bytes), bool(groups))
    print(wrong)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
