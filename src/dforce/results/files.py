"""Files of results, netCDF and tables, written whole or not at all."""

from __future__ import annotations

import csv
import hashlib
import io
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.errors import ResultError, checked
from dforce.core.files import check_target, in_quotes, read_input, write_whole
from dforce.core.quantities import AMOUNTS, NONE
from dforce.results import hdf5
from dforce.results.dataset import COLUMN_DIMS
from dforce.results.provenance import FOLDER, folder_of_plugins
from dforce.results.significance import is_none
from dforce.results.store import is_store, open_store

if TYPE_CHECKING:
    import xarray as xr


MOST_BYTES = 4_000_000_000  # of a file, which is read into memory
SEAL = b"\ndForce sha256 "  # before the hash at the end of a file
SEAL_LENGTH = len(SEAL) + 64
TO_GO_ON = ("motion", "component", "component_units")  # variables from which a stopped run goes on
BELOW = f"{NONE} (below its estimated error): "  # before a number in the heading of a table
ELSEWHERE = ("title", "dforce_version", "case")  # attributes with lines of their own in a table
# Where a spreadsheet would see a formula: at the start of a cell, for any separator; the number with a
# unit that a list in a case may go on with is none.
FORMULA = re.compile(
    r"""(^[\s"]*|[,;\t][\s"]*)(?![+-]?[\d.]+(?:e[+-]?\d+)?(?: [\w/^µ°%]+)?[\s"'\]})]*(?:$|[,;\t]))([=+@＝＋－＠-])""",
    re.IGNORECASE,
)
BOOLEANS = "boolean_attributes"  # netCDF has no booleans: this attribute names variables kept as 0 and 1


@checked
def write(dataset: xr.Dataset, path: str | os.PathLike[str], *, overwrite: bool = True) -> Path:
    """Write a result to netCDF (``.nc``) or a table (``.csv``), whole or not at all, and return the path.

    netCDF keeps everything for :func:`read`. The table has columns in SI with names such as ``amplitude_tone1 (m)``, and a row
    for each distance (and direction) or time. Comment lines contain the case and the versions:
    ``pandas.read_csv(path, comment="#")`` reads the table.

    Raises
    ------
    ResultError
        For another ending, a missing folder, a full disk, or a folder without write permission.
    FileExistsError
        When `overwrite` is off and the file exists.
    """
    target = check_target(path)
    write_whole(target, encoded(dataset, target.suffix), overwrite=overwrite)
    return target


def encoded(dataset: xr.Dataset, suffix: str) -> bytes | memoryview:
    """Return the bytes of a result's file with this ending, ``.nc`` or ``.csv``."""
    return _table(dataset).encode() if suffix.lower() == ".csv" else _netcdf(dataset)


def _netcdf(dataset: xr.Dataset) -> memoryview:
    """Return a netCDF file; it is made in memory, for HDF5 ends the process where a disk is full."""
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    stored = dataset.copy().drop_encoding()
    stored.attrs = _plain_attributes(dataset.attrs)
    for name in stored.variables:
        stored[name].attrs = _plain_attributes(dataset[name].attrs)
    content = io.BytesIO()
    with h5netcdf.File(content, "w") as file:
        stored.dump_to_store(H5NetCDFStore(file))
    seal = _seal(content.getbuffer())
    content.seek(0, io.SEEK_END)
    content.write(seal)
    return content.getbuffer()  # no copy: a sweep may be large


def _seal(content: bytes | memoryview) -> bytes:
    """Return the seal for the end of a file, which HDF5 does not read: the hash of all before it."""
    return SEAL + hashlib.sha256(content).hexdigest().encode()


def is_sealed(content: bytes) -> bool:
    """Return whether a file ends in a seal of dForce."""
    return content[-SEAL_LENGTH:].startswith(SEAL)


def is_whole(content: bytes) -> bool:
    """Return whether a file matches its seal; a file of another program has no seal and counts as whole."""
    return not is_sealed(content) or _seal(memoryview(content)[:-SEAL_LENGTH]) == content[-SEAL_LENGTH:]


def _plain_attributes(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Return attributes that netCDF can hold: booleans as 0 and 1, named in an attribute of their own."""
    plain = {str(key): value for key, value in attributes.items()}
    booleans = [key for key, value in plain.items() if isinstance(value, bool | np.bool_)]
    for key, value in plain.items():
        if key in booleans:
            plain[key] = np.int8(value)
        elif isinstance(value, str):
            plain[key] = value.replace("\0", "\N{REPLACEMENT CHARACTER}")  # HDF5 ends a text at a zero
    return plain | ({BOOLEANS: " ".join(booleans)} if booleans else {})


def _python_attributes(attributes: Mapping[object, object]) -> dict[str, Any]:
    """Undo :func:`_plain_attributes`."""
    python = {str(k): v.item() if isinstance(v, np.generic) else v for k, v in attributes.items()}
    for key in str(python.pop(BOOLEANS, "")).split():
        if key in python:  # a file that others wrote may name one that it lacks
            python[key] = bool(python[key])
    return python


@checked
def read(path: str | os.PathLike[str]) -> xr.Dataset:
    """Return the result in a netCDF file or in a store (``.zarr``) of dForce.

    The numbers of a store are read on use, so it may be larger than the memory.

    Raises
    ------
    ResultError
        When the file does not exist, is not netCDF, is damaged or incomplete, or is not from dForce.
    """
    if is_store(path):
        return _at(open_store(path), path)
    content = read_input(path, "result; keep a larger result as a store (.zarr)", MOST_BYTES, ResultError)
    return _at(decoded(content, in_quotes(path), Path(path).suffix), path)


def _at(result: xr.Dataset, path: str | os.PathLike[str]) -> xr.Dataset:
    """Return a result whose plug-ins are looked for beside its file, where their own folder does not exist here."""
    folder = folder_of_plugins(result.attrs)
    if folder is not None and not folder.is_dir():
        result.attrs[FOLDER] = str(Path(path).resolve().parent)
    return result


def decoded(content: bytes, name: str, suffix: str = "") -> xr.Dataset:
    """Return the result in the bytes of a file that dForce wrote; `suffix` is the ending of the file's name.

    Raises
    ------
    ResultError
        As :func:`read`.
    """
    if not content:
        raise ResultError(f"{name} is empty")
    if content.startswith(b"CDF"):
        raise ResultError(f"{name} is not from dForce: it is netCDF-3")
    if not content.startswith(hdf5.START):
        hint = "; pandas.read_csv(path, comment='#') reads a table of dForce, dforce read FILE a measured curve"
        raise ResultError(f"{name} is not a netCDF file{hint if suffix.lower() == '.csv' else ''}")
    # HDF5 may run for ever on a damaged file: it opens only files that may be whole
    dataset = _dataset(content) if is_whole(content) else None
    if dataset is None:
        raise ResultError(f"{name} is damaged or was cut short")
    if not ("dforce_version" in dataset.attrs or is_sealed(content)):  # states at a set point have no version
        raise ResultError(f"{name} is not a file of dForce")
    dataset.attrs = _python_attributes(dataset.attrs)
    for key in list(dataset.variables):
        variable = dataset[key]
        if variable.dtype.kind in "OT":
            dataset[key] = variable.astype(np.str_)
        dataset[key].attrs = _python_attributes(variable.attrs)
    return dataset


def _dataset(content: bytes) -> xr.Dataset | None:
    """Return the contents of a netCDF file, empty if it is not from dForce; None where it is damaged."""
    import h5netcdf
    import h5py
    import xarray as xr
    from xarray.backends import H5NetCDFStore

    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            # h5netcdf prints a traceback when it cannot read these
            if not ("dforce_version" in dict(file.attrs) or is_sealed(content)):
                return xr.Dataset()
        with h5netcdf.File(io.BytesIO(content), "r", decode_vlen_strings=True) as file:
            return xr.load_dataset(H5NetCDFStore(file), decode_times=False).drop_encoding()
    except Exception:  # a damaged file surfaces as any error of h5py, h5netcdf or xarray  # noqa: BLE001
        return None


def _table(dataset: xr.Dataset) -> str:
    """Return a result as text: comment lines, then a table as in RFC 4180."""
    scalars, tables = _columns(dataset.drop_vars(TO_GO_ON, errors="ignore"))  # a table is never continued
    lines = [
        str(dataset.attrs.get("title", "")),
        f"written by dForce {dataset.attrs.get('dforce_version', '')}",
        *(f"{key}: {value}" for key, value in dataset.attrs.items() if key not in ELSEWHERE),
    ]
    none = _none(dataset)
    lines += [f"{name} = {BELOW if name in none else ''}{_cell(values[0])}" for name, values in scalars.items()]
    lines += ["", "the case:", *str(dataset.attrs.get("case", "")).splitlines()]
    text = io.StringIO(newline="")
    for line in lines:
        # a line break in a title must not end the comment
        text.write("# " + FORMULA.sub(r"\1'\2", " ".join(line.splitlines())) + "\r\n")
    columns = {name: values for table in tables for name, values in table.items()} or scalars
    writer = csv.writer(text)
    writer.writerow([_cell(name) for name in columns])
    rows = max(len(values) for values in columns.values())
    for row in range(rows):
        writer.writerow([_cell(values[row]) if row < len(values) else "" for values in columns.values()])
    return text.getvalue()


def _none(dataset: xr.Dataset) -> set[str]:
    """Return the columns of the numbers without rows that are below their estimated error."""
    pairs = ((name, dataset[name].copy(data=is_none(dataset, name))) for name in AMOUNTS if name in dataset)
    columns = (pair for name, none in pairs for pair in _unstack(name, none, COLUMN_DIMS))
    return {column for column, none in columns if none.ndim == 0 and bool(none)}


def _cell(value: object) -> Any:
    """Return a value as a table holds it: the shortest text that gives the same number back; NaN is empty."""
    if isinstance(value, str):
        return FORMULA.sub(r"\1'\2", value)
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else repr(float(value))
    return value


def _columns(dataset: xr.Dataset) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the numbers without rows, and a table for each set of dimensions that belong together.

    An approach is one table over direction and zc; traces and spectrum of a dwell are two, side by side. The jumps of a
    single curve have their own table; the jumps of a sweep are columns.
    """
    import xarray as xr

    of_sweep = any("jump" in variable.dims and variable.ndim > 1 for variable in dataset.variables.values())
    across = (*COLUMN_DIMS, "jump") if of_sweep else COLUMN_DIMS
    groups: list[list[str]] = []
    for variable in dataset.variables.values():
        group = [str(dim) for dim in variable.dims if dim not in across]
        apart = [other for other in groups if not set(other) & set(group)]
        joined = [dim for other in groups if other not in apart for dim in other]
        groups = [*apart, list(dict.fromkeys([*joined, *group]))] if group else groups
    scalars: dict[str, Any] = {}
    tables: list[dict[str, Any]] = [{} for _ in groups]
    order = [*(str(name) for name in dataset.coords), *(str(name) for name in dataset.data_vars)]
    for name in (name for name in order if name not in COLUMN_DIMS):
        for column, values in _unstack(name, dataset[name], across):
            index = next((i for i, group in enumerate(groups) if set(values.dims) & set(group)), None)
            if index is None:
                scalars[column] = values.values.ravel()
                continue
            # directions first, so that one sweep is below the other
            dims = sorted(groups[index], key=lambda dim: dim != "direction")
            shape = xr.DataArray(np.empty([dataset.sizes[dim] for dim in dims]), dims=dims)
            tables[index][column] = values.broadcast_like(shape).transpose(*dims).values.ravel()
    return scalars, tables


def _unstack(name: str, variable: xr.DataArray, across: Sequence[str]) -> Iterator[tuple[str, xr.DataArray]]:
    """Give a column for each tone, mode and so on of a variable: amplitude_tone1, partial_force_dmt."""
    for dim in across:
        if dim in variable.dims:
            labels = variable[dim].values if dim in variable.coords else range(1, variable.sizes[dim] + 1)
            for index, label in enumerate(labels):
                column = f"{name}_{'' if dim == 'model' else dim}{label}"
                yield from _unstack(column, variable.isel({dim: index}, drop=True), across)
            return
    if "flag_meanings" in variable.attrs:
        flags = np.atleast_1d(variable.attrs["flag_values"]).tolist()
        words = dict(zip(flags, variable.attrs["flag_meanings"].split(), strict=True))
        yield name, variable.copy(data=np.vectorize(words.get, otypes=[object])(variable.values))
        return
    unit = variable.attrs.get("units", "1")
    yield (f"{name} ({unit})" if unit != "1" else name), variable
