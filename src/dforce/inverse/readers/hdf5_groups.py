"""What an HDF5 file holds, read by a process of its own: the file on its standard input, the answer on its output."""

from __future__ import annotations

import io
import pickle
import sys
from typing import Any

import numpy as np

from dforce.inverse.table import Column
from dforce.inverse.words import known_unit, split_heading

MOST_GROUPS = 100_000
MOST_PACKED = 1000  # times the size of the file that a column may have, once it is unpacked


def groups_in(content: bytes) -> list[tuple[list[tuple[Any, ...]], dict[str, str]]]:
    """Return the columns and the notes of each group that holds columns of one length."""
    import h5py

    found = []
    with h5py.File(io.BytesIO(content), "r") as file:
        notes = _notes(file)
        groups: list[Any] = [file]
        for group in groups:  # grows while it is gone through
            members = [group[key] for key in group]
            groups += [member for member in members if isinstance(member, h5py.Group)]
            if len(groups) > MOST_GROUPS:
                raise ValueError("more groups than curves of any map")
            columns = [_column(member) for member in members if _is_column(member, len(content))]
            if len(columns) > 1 and len({len(column.values) for column in columns}) == 1:
                found.append(([tuple(column) for column in columns], notes | _notes(group)))
    return found


def _is_column(member: Any, size: int) -> bool:
    """Say whether a member of a group is a column of numbers or words."""
    if getattr(member, "ndim", None) != 1 or member.dtype.kind not in "fiuSO" or len(member) < 2:
        return False
    if len(member) * member.dtype.itemsize > MOST_PACKED * size:
        raise ValueError("a damaged length, which would fill the memory")
    return True


def _column(member: Any) -> Column:
    values = member.asstr()[:] if member.dtype.kind in "SO" else np.asarray(member[:], dtype=float)
    title, unit = split_heading(str(member.name).rpartition("/")[2])
    attributes = _notes(member)
    said = attributes.get("units", attributes.get("unit"))
    if said is not None:
        unit = known_unit(said)
    return Column(title, unit, np.asarray(values, dtype=str) if member.dtype.kind in "SO" else values)


def _notes(thing: Any) -> dict[str, str]:
    """Return the attributes of a group or a data set that are numbers or texts."""
    notes = {}
    for key, value in thing.attrs.items():
        if isinstance(value, bytes):
            value = value.decode("utf-8", "replace")
        if isinstance(value, str) or np.ndim(value) == 0:
            notes[str(key)] = str(value)
    return notes


if __name__ == "__main__":
    sys.stdout.buffer.write(pickle.dumps(groups_in(sys.stdin.buffer.read())))
