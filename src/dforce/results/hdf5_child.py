"""Checks an HDF5 file of unknown origin; run as a subprocess, which may fail without harm.

HDF5 files may point to other files, contain data that unpack to any size, or be broken so that the library crashes or runs
for ever. ``python hdf5_child.py result`` reads all of the file on its standard input within limits; with ``curves`` it
reads the columns of measured curves. A pickle on its output contains an error message, empty for a good file, and the
curves: for each its columns (name, attributes, values) and its notes.
"""

from __future__ import annotations

import io
import pickle
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import h5py

    from dforce.core.arrays import AnyArray

    Column = tuple[str, dict[str, str], AnyArray]
    Curve = tuple[list[Column], dict[str, str]]

MOST_MEMORY = 4_000_000_000  # bytes of the process
MOST_SECONDS = 20  # of computing
MOST_UNPACKED = 200_000_000  # bytes of the data in a file
MOST_PACKED = 4  # times its own size that a larger file of curves may unpack to
MOST_MEMBERS = {"result": 500, "curves": 500_000}  # groups and data sets
PLAIN = "fiubSO"  # kinds of numbers and texts
COLUMNS = "fiuSO"  # the same in columns
COMPRESSIONS = (None, "gzip", "lzf")
ELSEWHERE = "it points to other files or places"


class Wrong(Exception):
    """A file must not be read; the text is the reason."""


def look(content: bytes, kind: str) -> list[Curve]:
    """Return the measured curves in a file; none of a result, of which everything is read.

    Raises
    ------
    Wrong
        When the file is not to be read.
    """
    import h5py

    with h5py.File(io.BytesIO(content), "r") as file:
        groups = _groups(file, kind)
        if kind == "curves":
            return _curves(groups, max(MOST_UNPACKED, MOST_PACKED * len(content)))
        _read_all(groups)
    return []


def _groups(file: h5py.File, kind: str) -> list[tuple[h5py.Group, list[h5py.Dataset]]]:
    """Return each group with its data sets; no link is followed, and a link to another file is an error."""
    import h5py

    found: list[tuple[h5py.Group, list[h5py.Dataset]]] = [(file, [])]
    count = 0
    for group, members in found:  # grows while it is gone through
        count += len(group)
        if count > MOST_MEMBERS[kind]:  # a group that contains itself ends here, too
            raise Wrong(f"it contains more than {MOST_MEMBERS[kind]} groups and data sets")
        for name in group:
            link = group.get(name, getlink=True)
            if isinstance(link, h5py.SoftLink) and kind == "curves":
                continue  # its data are found at their own place
            if not isinstance(link, h5py.HardLink):
                raise Wrong(ELSEWHERE)
            member = group[name]
            if isinstance(member, h5py.Dataset):
                if member.is_virtual or member.external:
                    raise Wrong("it takes data from other files")
                members.append(member)
            elif kind == "result":
                raise Wrong("it contains groups, unlike a result")
            elif isinstance(member, h5py.Group):
                found.append((member, []))
    return found


def _read_all(groups: list[tuple[h5py.Group, list[h5py.Dataset]]]) -> None:
    """Read all of a result, so that a broken part fails here."""
    total = 0
    for group, members in groups:
        for member in members:
            if member.dtype.kind not in PLAIN or (member.dtype.kind == "O" and not _is_text(member.dtype)):
                raise Wrong("it contains data that are neither numbers nor text")
            if member.compression not in COMPRESSIONS:
                raise Wrong("its compression is unlike a result")
            total += member.nbytes
            if total > MOST_UNPACKED:
                raise Wrong(f"it unpacks to more than {MOST_UNPACKED // 1_000_000} MB")
        for member in members:
            dict(group.attrs), dict(member.attrs), member[()]


def _curves(groups: list[tuple[h5py.Group, list[h5py.Dataset]]], most: int) -> list[Curve]:
    """Return the columns and the notes of each group that holds columns of one length."""
    found, total = list[Any](), 0
    for group, members in groups:
        columns = [member for member in members if _is_column(member)]
        if len(columns) < 2 or len({len(column) for column in columns}) > 1:
            continue
        total += sum(max(column.nbytes, 8 * len(column)) for column in columns)
        if total > most:
            raise Wrong(f"it unpacks to more than {most // 1_000_000} MB")
        read = [(str(column.name).rpartition("/")[2], _notes(column), _values(column)) for column in columns]
        found.append((read, _notes(groups[0][0]) | _notes(group)))
    return found


def _is_column(member: h5py.Dataset) -> bool:
    plain = member.dtype.kind in COLUMNS and (member.dtype.kind != "O" or _is_text(member.dtype))
    return bool(plain and member.ndim == 1 and len(member) > 1)


def _is_text(dtype: object) -> bool:
    import h5py

    return h5py.check_string_dtype(dtype) is not None


def _values(column: h5py.Dataset) -> Any:
    return column.asstr()[:].astype(str) if column.dtype.kind in "SO" else column[:].astype(float)


def _notes(thing: h5py.HLObject) -> dict[str, str]:
    """Return the attributes of a group or a data set that are numbers or texts."""
    notes = {}
    for key, value in thing.attrs.items():
        if isinstance(value, bytes):
            value = value.decode("utf-8", "replace")
        if isinstance(value, str) or getattr(value, "ndim", 0) == 0:
            notes[str(key)] = str(value)
    return notes


def main(kind: str) -> None:
    """Look through the file on the standard input, and write the answer."""
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))
    except (ImportError, ValueError, OSError):  # Windows has no such limits
        pass
    try:
        answer = "", look(sys.stdin.buffer.read(), kind)
    except Wrong as wrong:
        answer = str(wrong), []
    sys.stdout.buffer.write(pickle.dumps(answer))


if __name__ == "__main__":
    main(sys.argv[1])
