"""Results: what a Dataset says about itself, and files of results, written whole or not at all."""

from __future__ import annotations

import contextlib
import csv
import datetime
import enum
import functools
import importlib.metadata
import io
import os
import platform
import re
import secrets
import stat
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce import quantities, units
from dforce.errors import ResultError, shorten

if TYPE_CHECKING:
    import xarray as xr

SUFFIXES = (".nc", ".csv")
ELECTRONVOLT = 1.602176634e-19  # J; exact in the SI since 2019
COLUMN_DIMS = ("tone", "mode", "harmonic", "multiplier", "model")  # columns of a table; others are its rows
ELSEWHERE = ("title", "dforce_version", "case")  # attributes with lines of their own in a table
BOOLEANS = "boolean_attributes"  # netCDF has no booleans: this attribute names those kept as 0 and 1


class Status(enum.IntEnum):
    """What became of a point of a result; `sentence` says it in words."""

    sentence: str

    def __new__(cls, value: int, sentence: str) -> Status:
        """Make the number carry its sentence."""
        member = int.__new__(cls, value)
        member._value_ = value
        member.sentence = sentence
        return member

    OK = 0, "the motion settled"
    NOT_SETTLED = 1, "the motion had not settled after the largest number of periods allowed"
    NOT_REPEATING = 2, "the motion settled into one that does not repeat from period to period"
    NOT_COMPUTED = 3, "the run was stopped before this point"
    FAILED = 4, "the motion grew beyond all bounds, so that there is no result here"

    @property
    def meaning(self) -> str:
        """Return the word for it in a Dataset's `flag_meanings`."""
        return self.name.lower()


def describe(dataset: xr.Dataset) -> xr.Dataset:
    """Give every standard variable its attributes `units`, `long_name`, `symbol` and `description`.

    The words come from :mod:`dforce.quantities`. `status` becomes int8 with CF flags and a sentence for each
    (`flag_sentences`, one a line). The Dataset is changed in place and returned.
    """
    known = quantities.OBSERVABLES | quantities.TRACES | quantities.JUMPS | quantities.AXES
    for name, variable in dataset.variables.items():
        row = known.get(str(name))
        if row is not None:
            words = {"units": row.unit, "long_name": row.label, "symbol": row.symbol, "description": row.doc}
            variable.attrs.update({key: word for key, word in words.items() if word})
    if "status" in dataset:
        if dataset["status"].dtype != np.int8:
            dataset["status"] = dataset["status"].astype(np.int8)
        dataset.variables["status"].attrs.update(
            long_name="status",
            flag_values=np.array([status.value for status in Status], dtype=np.int8),
            flag_meanings=" ".join(status.meaning for status in Status),
            flag_sentences="\n".join(status.sentence for status in Status),
        )
    return dataset


def provenance(case: str, title: str = "") -> dict[str, str]:
    """Return the attributes that say where a result comes from.

    Parameters
    ----------
    case
        The whole case as TOML text; ``dforce run OUT.nc`` repeats the run from it.
    title
        Title of the case.
    """
    date = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    return {"title": title, "case": case, **_surroundings(), "date": date}


@functools.cache  # reading them anew takes as long as solving a curve
def _surroundings() -> dict[str, str]:
    """Return the versions and the platform of this process."""
    packages = ("dforce", "numpy", "numba", "scipy")
    versions = {f"{name}_version": importlib.metadata.version(name) for name in packages}
    return versions | {"python_version": platform.python_version(), "platform": platform.platform()}


def reader_unit(variable: xr.DataArray) -> tuple[float, str]:
    """Return (scale, name) of the unit in which a variable reads best: nm rather than 1e-9 m.

    What is shown is the value divided by `scale`; the largest value chooses the unit.
    """
    unit = str(variable.attrs.get("units", "1"))
    values = np.abs(np.asarray(variable.values, dtype=float))
    finite = values[np.isfinite(values)]
    return unit_for(float(finite.max()) if finite.size else 0.0, unit, str(variable.name))


def unit_for(size: float, unit: str, name: str = "") -> tuple[float, str]:
    """Return (scale, name) of the unit for a value of this size, in the spelling of print: µm/s, °, %, eV."""
    if unit in ("degree", "deg"):
        return 1.0, "°"
    if unit == "J":  # energies of a tapping cycle: the field counts in eV
        for scale, shown in ((1e-15, "fJ"), (1e3 * ELECTRONVOLT, "keV"), (0.1 * ELECTRONVOLT, "eV")):
            if size >= scale:
                return (ELECTRONVOLT, shown) if shown == "eV" else (scale, shown)
        return (1e-3 * ELECTRONVOLT, "meV") if size else (ELECTRONVOLT, "eV")
    observable = (quantities.OBSERVABLES | quantities.AXES).get(name)
    if observable is not None and observable.shown == "%":
        return 0.01, "%"
    scale, chosen = units.reader_unit(size, unit)
    return scale, re.sub(r"^u(?=[a-zA-Z])", "µ", chosen)


def check_target(path: str | os.PathLike[str], suffixes: Sequence[str] = SUFFIXES) -> Path:
    """Return the path of a file to be written, after checking that it can be.

    Raises
    ------
    ResultError
        When the ending is none of `suffixes`, the folder does not exist, or the place is taken by something
        that may not be replaced.
    """
    target, name = Path(path), f"'{shorten(str(path))}'"
    if target.suffix.lower() not in suffixes:
        ending = f"ends in '{target.suffix}'" if target.suffix else "has no ending"
        raise ResultError(f"{name} {ending}; a file ending in {', '.join(suffixes)} can be written")
    folder = target.resolve().parent
    if not folder.is_dir():
        raise ResultError(f"{name} cannot be written: there is no folder '{shorten(str(folder))}'")
    if target.exists() and not target.is_file():
        raise ResultError(f"{name} cannot be written: it is not a file")
    if not os.access(target if target.exists() else folder, os.W_OK):
        raise ResultError(f"{name} cannot be written: it may not be changed by this user")
    return target


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str], *, overwrite: bool = True) -> Iterator[Path]:
    """Give a temporary file to write; on leaving, it takes the place of `path` in one step.

    After a failure, Ctrl-C or a power cut `path` is what it was before.

    Raises
    ------
    ResultError
        When the file cannot be written.
    FileExistsError
        When `overwrite` is off and `path` exists.
    """
    target = Path(os.path.realpath(path))  # a link stays a link
    temporary = target.with_name(f".dforce-{secrets.token_hex(8)}.tmp")
    try:
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))  # the user's umask applies
        if target.exists():
            temporary.chmod(stat.S_IMODE(target.stat().st_mode))
        yield temporary
        _to_disk(temporary, os.O_RDWR)
        if overwrite:
            temporary.replace(target)
        else:
            _move_beside(temporary, target)
        if os.name == "posix":  # the name, too, has to survive a power cut
            _to_disk(target.parent, os.O_RDONLY)
    except FileExistsError:
        raise
    except OSError as error:
        reason = error.strerror or str(error)
        raise ResultError(f"'{shorten(str(path))}' could not be written: {reason.lower()}") from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def _to_disk(path: Path, flags: int) -> None:
    descriptor = os.open(path, flags)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _move_beside(temporary: Path, target: Path) -> None:
    """Move a file to a name that is free; a name taken in this very moment is an error, not a loss."""
    try:
        os.link(temporary, target)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links
        if target.exists():
            raise FileExistsError(target) from None
        temporary.rename(target)


def write(dataset: xr.Dataset, path: str | os.PathLike[str], *, overwrite: bool = True) -> Path:
    """Write a result to netCDF (``.nc``) or a table (``.csv``), whole or not at all, and return the path.

    netCDF keeps everything; :func:`read` gives it back. The table has SI columns with names such as
    ``amplitude_tone1 (m)``, a row for each distance (and direction) or instant, and the case and versions in
    comment lines:
    ``pandas.read_csv(path, comment="#")`` reads it.

    Raises
    ------
    ResultError
        For another ending, a missing folder, a full disk, or a place that may not be written.
    FileExistsError
        When `overwrite` is off and the file exists.
    """
    target = check_target(path)
    with whole_file(target, overwrite=overwrite) as temporary:
        if target.suffix.lower() == ".csv":
            temporary.write_text(_table(dataset), encoding="utf-8", newline="")
        else:
            _to_netcdf(dataset, temporary)
    return target


def _to_netcdf(dataset: xr.Dataset, path: Path) -> None:
    stored = dataset.copy().drop_encoding()
    stored.attrs = _plain_attributes(dataset.attrs)
    for name in stored.variables:
        stored[name].attrs = _plain_attributes(dataset[name].attrs)
    try:
        stored.to_netcdf(path, engine="h5netcdf")
    except RuntimeError as error:  # HDF5's word for a full disk
        raise OSError(str(error)) from error


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


def _python_attributes(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Undo :func:`_plain_attributes`."""
    python = {str(k): v.item() if isinstance(v, np.generic) else v for k, v in attributes.items()}
    for key in str(python.pop(BOOLEANS, "")).split():
        python[key] = bool(python[key])
    return python


def read(path: str | os.PathLike[str]) -> xr.Dataset:
    """Return the result in a netCDF file that dForce wrote.

    Raises
    ------
    ResultError
        When there is no such file, or it is not netCDF, damaged, cut short, or not written by dForce.
    """
    import xarray as xr

    name = f"'{shorten(str(path))}'"
    try:
        with Path(path).open("rb") as file:
            start = file.read(8)
    except FileNotFoundError:
        raise ResultError(f"there is no file {name}") from None
    except OSError as error:
        raise ResultError(f"{name} cannot be read: {(error.strerror or str(error)).lower()}") from None
    if not start:
        raise ResultError(f"{name} is empty")
    if start[:3] == b"CDF":
        raise ResultError(f"{name} was not written by dForce: it is of the older netCDF-3 kind")
    if start != b"\x89HDF\r\n\x1a\n":
        table = Path(path).suffix.lower() == ".csv"
        hint = "; pandas.read_csv(path, comment='#') reads a table" if table else ""
        raise ResultError(f"{name} is not a netCDF file{hint}")
    try:
        dataset = xr.load_dataset(path, engine="h5netcdf", decode_times=False).drop_encoding()
    except Exception as error:  # a damaged file surfaces as any error of h5py, h5netcdf or xarray
        raise ResultError(f"{name} is damaged or was cut short") from error
    if "dforce_version" not in dataset.attrs:
        raise ResultError(f"{name} was not written by dForce")
    dataset.attrs = _python_attributes(dataset.attrs)
    for key in list(dataset.variables):
        variable = dataset[key]
        if variable.dtype.kind in "OT":
            dataset[key] = variable.astype(np.str_)
        dataset[key].attrs = _python_attributes(variable.attrs)
    return dataset


def _table(dataset: xr.Dataset) -> str:
    """Return a result as text: comment lines, then a table as in RFC 4180."""
    scalars, tables = _columns(dataset.drop_vars("restart", errors="ignore"))  # a table is never continued
    lines = [
        str(dataset.attrs.get("title", "")),
        f"written by dForce {dataset.attrs.get('dforce_version', '')}",
        *(f"{key}: {value}" for key, value in dataset.attrs.items() if key not in ELSEWHERE),
    ]
    lines += [f"{name} = {_cell(values[0])}" for name, values in scalars.items()]
    lines += ["", "the case:", *str(dataset.attrs.get("case", "")).splitlines()]
    text = io.StringIO(newline="")
    for line in lines:
        # a line break in a title must not end the comment
        text.write("# " + " ".join(line.splitlines()) + "\r\n")
    columns = {name: values for table in tables for name, values in table.items()} or scalars
    writer = csv.writer(text)
    writer.writerow(columns)
    rows = max(len(values) for values in columns.values())
    for row in range(rows):
        writer.writerow([_cell(values[row]) if row < len(values) else "" for values in columns.values()])
    return text.getvalue()


def _cell(value: Any) -> Any:
    """Return a value as a table holds it: the shortest text that gives the same number back; NaN is empty."""
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else repr(float(value))
    return value


def _columns(dataset: xr.Dataset) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the numbers without rows, and a table for each set of dimensions that belong together.

    An approach is one table over direction and zc; traces and spectrum of a dwell are two, side by side. The jumps of a
    single curve are a table of their own, those of each curve of a sweep are columns.
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
            # directions first, so that one sweep stands below the other
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
