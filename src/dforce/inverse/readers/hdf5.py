"""HDF5: a data set for each quantity, its unit in the attribute `units`; each group that holds some is a curve."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from dforce.errors import ResultError
from dforce.inverse.table import Column, Table
from dforce.inverse.words import known_unit, split_heading

MOST_GROUPS = 100_000


def read(content: bytes, name: str) -> list[Table]:
    """Return the curves in an HDF5 file.

    Raises
    ------
    ResultError
        When it is damaged, or no group of it holds columns of one length.
    """
    import h5py

    found: list[Table] = []
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            notes = _notes(file)
            groups: list[Any] = [file]
            while groups:
                group = groups.pop(0)
                members = [group[key] for key in group]
                groups += [member for member in members if isinstance(member, h5py.Group)][:MOST_GROUPS]
                columns = [_column(member) for member in members if _is_column(member)]
                if len(columns) > 1 and len({len(column.values) for column in columns}) == 1:
                    found.append(Table(tuple(columns), "HDF5", notes=notes | _notes(group)))
    except Exception as error:  # a damaged file surfaces as any error of h5py
        raise ResultError(f"{name} is damaged or was cut short") from error
    if not found:
        raise ResultError(f"{name} has no group with data sets of one length, which the columns of a curve are")
    return found


def _is_column(member: Any) -> bool:
    return getattr(member, "ndim", None) == 1 and member.dtype.kind in "fiuSO" and len(member) > 1


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
