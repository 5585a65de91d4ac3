"""HDF5: a data set for each quantity, its unit in the attribute `units`; each group that holds some is a curve."""

from __future__ import annotations

from dforce.core.errors import ResultError
from dforce.inverse.table import Column, MeasuredTable, Reader
from dforce.inverse.words import known_unit, split_heading
from dforce.results import hdf5


def read(content: bytes, name: str) -> list[MeasuredTable]:
    """Return the curves in an HDF5 file.

    Raises
    ------
    ResultError
        When it is damaged, or no group of it holds columns of one length.
    """
    tables = []
    for columns, notes in hdf5.look(content, "curves", name):
        named = []
        for heading, attributes, values in columns:
            title, unit = split_heading(heading)
            said = attributes.get("units", attributes.get("unit"))
            named.append(Column(title, unit if said is None else known_unit(said), values))
        tables.append(MeasuredTable(tuple(named), notes))
    if not tables:
        raise ResultError(f"{name} has no group with data sets of equal length, the columns of a curve")
    return tables


READER = Reader(
    kind="HDF5",
    endings=(".h5", ".hdf5"),
    is_one=lambda content: content.startswith(hdf5.START),
    read=read,
    not_read={b"CDF": "is netCDF of the old version 3; convert it to version 4"},
    how="a data set for each quantity, its unit in the attribute `units`; each group is a curve",
    seen="no: no common layout exists",
)
