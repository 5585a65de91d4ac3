"""Stores of large results: zarr, in blocks of cases that are written whole or not at all, and read as far as they are needed.

A block is one chunk of each array. The chunk of `status` is written last, so what is done is read from `status` alone. Each
chunk is written under another name and moved to its place; one process at a time may write, and holds a lock beside the store.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.request import url2pathname

import numpy as np

from dforce.core.errors import ParameterError, ResultError, shorten
from dforce.core.files import reason
from dforce.core.quantities import OBSERVABLES

if TYPE_CHECKING:
    import xarray as xr

SUFFIX = ".zarr"
STATUS = "status"
UNFINISHED = "interrupted"  # attribute of a store until all its blocks are written
BEING_MADE = "dforce_being_made"  # attribute of a store whose arrays are not all there
NOTES = "notes"  # attribute: what became of blocks that are not as they should be, a sentence a line
COORDINATES = "coordinates"  # attribute by which xarray knows coordinates among the arrays


@dataclass(frozen=True)
class Variable:
    """An array of a store that is written in blocks.

    Attributes
    ----------
    dims, dtype, attrs
        Its dimensions, kind of numbers (str: text), and attributes.
    fill
        What stands where nothing was written.
    is_coordinate
        Whether it belongs to the coordinates of the result.
    """

    dims: tuple[str, ...]
    dtype: Any
    fill: Any
    attrs: Mapping[str, Any]
    is_coordinate: bool = False


@dataclass(frozen=True)
class Blocks:
    """How cases are cut into blocks: the length of each dimension, and of a block along it."""

    sizes: Mapping[str, int]
    block: Mapping[str, int]

    def places(self) -> Iterator[dict[str, slice]]:
        """Give the place of each block."""
        starts = [range(0, size, self.block[dim]) for dim, size in self.sizes.items()]
        for corner in itertools.product(*starts):
            yield {
                dim: slice(start, min(start + self.block[dim], self.sizes[dim]))
                for dim, start in zip(self.sizes, corner, strict=True)
            }

    @property
    def count(self) -> int:
        """Number of blocks."""
        return math.prod(-(-size // self.block[dim]) for dim, size in self.sizes.items())


def is_store(path: str | os.PathLike[str]) -> bool:
    """Say whether a path is that of a store: a folder that ends in ``.zarr``, or a URL."""
    return str(path).rstrip("/").lower().endswith(SUFFIX)


def check_store(path: str | os.PathLike[str], resume: bool) -> None:
    """Check that a store can be made at a path, or is there to go on with.

    Raises
    ------
    ResultError
        When the ending is not ``.zarr``, there is no such folder to make it in, something is there already, or nothing is
        to go on with.
    """
    _zarr()
    name = _name(path)
    if not is_store(path):
        raise ResultError(f"{name} does not end in '{SUFFIX}', as a store does")
    target = local_place(path)
    try:
        if target is not None and not target.resolve().parent.is_dir():
            raise ResultError(f"{name} cannot be written: there is no folder '{shorten(str(target.resolve().parent))}'")
        there = target.exists() if target is not None else _is_there(str(path))
    except ResultError:
        raise
    except (OSError, ValueError) as error:
        raise ResultError(f"{name} cannot be written: {reason(error)}") from None
    if there and not resume:
        raise ResultError(f"{name} is there already; go on with it (resume), or choose another name")
    if resume and not there:
        raise ResultError(f"there is no store {name} to go on with")


def open_store(path: str | os.PathLike[str]) -> xr.Dataset:
    """Return the result in a store; its numbers are read when they are asked for.

    Raises
    ------
    ResultError
        When there is no such store, or it cannot be read, or was not written by dForce.
    """
    import xarray as xr

    _zarr()
    name = _name(path)
    place = local_place(path)
    if not (place.is_dir() if place is not None else _is_there(str(path))):
        raise ResultError(f"there is no store {name}")
    try:
        data: xr.Dataset = xr.open_zarr(str(place or path), chunks=None, consolidated=False, decode_times=False)
    except Exception as error:  # of zarr, xarray, or what reads the URL  # noqa: BLE001
        raise ResultError(f"{name} cannot be read as a store: {_said(error)}") from None
    if "dforce_version" not in data.attrs:
        raise ResultError(f"{name} was not written by dForce, or was not finished being made")
    words = {
        key: coord.copy(data=np.array(coord.values.tolist(), dtype=np.str_))
        for key, coord in data.coords.items()
        if coord.dtype.kind in "OT" and coord.ndim == 1
    }
    order = [name for name in OBSERVABLES if name in data]  # a folder has none
    data = data[[*order, *sorted(str(name) for name in data.data_vars if name not in order)]]
    return data.assign_coords(words)


class Writer:
    """Writes blocks into a store; a context manager that holds the store's lock.

    Raises
    ------
    ResultError
        When another run has the store open, and, in any method, when something cannot be read or written.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        import filelock

        self.folder = local_place(path)
        self.path = str(path) if self.folder is None else str(self.folder)
        self._lock = None if self.folder is None else filelock.FileLock(f"{self.path}.lock", timeout=0)
        self._group: Any = None
        self._arrays: dict[str, Any] = {}

    def __enter__(self) -> Writer:
        """Take the lock, and remove what a killed writer has left half-written."""
        import filelock

        if self._lock is None or self.folder is None:
            return self
        try:
            self._lock.acquire()
        except filelock.Timeout:
            raise ResultError(f"the store {_name(self.path)} is open in another run") from None
        except OSError as error:
            raise ResultError(f"{_name(self.path)} cannot be written: {reason(error)}") from None
        for part in self.folder.rglob("*.partial"):
            part.unlink(missing_ok=True)
        return self

    def __exit__(self, *raised: object) -> None:
        """Give the lock back."""
        if self._lock is not None:
            if os.name == "posix":  # Windows removes no file that is open
                Path(self._lock.lock_file).unlink(missing_ok=True)
            self._lock.release()

    def is_made(self) -> bool:
        """Say whether the store has all its arrays, so that blocks may be written; else it can be made anew."""
        zarr = _zarr()
        if self.folder is not None and not any(self.folder.iterdir()):
            return False
        with self._told():
            group = zarr.open_group(self.path, mode="r+")
        if BEING_MADE not in group.attrs and "dforce_version" not in group.attrs:
            raise ResultError(f"{_name(self.path)} was not written by dForce")
        self._take(group)
        return BEING_MADE not in group.attrs

    def make(
        self, variables: Mapping[str, Variable], coords: xr.Dataset, blocks: Blocks, inner: Mapping[str, int],
        attrs: Mapping[str, Any],
    ) -> None:  # fmt: skip
        """Make the store, with its arrays but none of their chunks.

        Parameters
        ----------
        variables
            The arrays that are written in blocks, by name, `status` among them.
        coords
            What is written once: coordinates.
        blocks, inner
            How the cases are cut, and the lengths of the dimensions behind them, which a block has whole.
        attrs
            Attributes of the result.
        """
        zarr = _zarr()
        with self._told():
            group = zarr.create_group(self.path, zarr_format=3, overwrite=self._group is not None,
                                      attributes={BEING_MADE: True})  # fmt: skip
            for name, one in variables.items():
                lengths = [{**blocks.sizes, **inner}[dim] for dim in one.dims]
                group.create_array(
                    name, shape=lengths, dtype=one.dtype, fill_value=one.fill, dimension_names=one.dims,
                    chunks=[max(1, {**blocks.block, **inner}[dim]) for dim in one.dims], attributes=_plain(one.attrs),
                    compressors=zarr.codecs.ZstdCodec(level=3, checksum=True),
                )  # fmt: skip
            for key, coord in coords.coords.items():
                text = coord.dtype.kind in "OUT"
                array = group.create_array(
                    str(key), shape=coord.shape, dtype=str if text else coord.dtype, chunks=[max(1, n) for n in coord.shape],
                    dimension_names=coord.dims, attributes=_plain(coord.attrs), fill_value="" if text else None,
                )  # fmt: skip
                array[...] = coord.values.astype(np.str_) if text else coord.values
            flagged = [*map(str, coords.coords), *(name for name, one in variables.items() if one.is_coordinate)]
            group.attrs.put(_plain(attrs) | {COORDINATES: " ".join(flagged), UNFINISHED: 1})
        self._take(group)

    def _take(self, group: Any) -> None:
        self._group, self._arrays = group, dict(group.arrays())

    def blocks(self, dims: Sequence[str]) -> Blocks:
        """Return how the store's cases are cut; `dims` are those of the cases."""
        status = self._arrays[STATUS]
        sizes, lengths = (
            dict(zip(status.metadata.dimension_names, n, strict=True)) for n in (status.shape, status.chunks)
        )
        return Blocks({dim: sizes[dim] for dim in dims}, {dim: lengths[dim] for dim in dims})

    def is_done(self, place: Mapping[str, slice], nothing: int) -> bool:
        """Say whether a block is written; `nothing` is the status of what was not computed."""
        try:
            return not bool((self._arrays[STATUS][self._region(STATUS, place)] == nothing).any())
        except Exception:  # a chunk that a power cut has spoiled is written again  # noqa: BLE001
            return False

    def put(self, place: Mapping[str, slice], arrays: Mapping[str, tuple[tuple[str, ...], Any]], broken: int) -> None:
        """Write a block, its status last.

        Parameters
        ----------
        place
            Where it is along the dimensions of the cases.
        arrays
            Dimensions and values by name. What is shorter than the store's dimension is filled up; of what is longer the
            first values are kept, and the store says so.
        broken
            The status where there is none.
        """
        with self._told():
            for name, (dims, values) in arrays.items():
                if name in self._arrays and name != STATUS:
                    self._arrays[name][self._region(name, place)] = self._fitted(name, place, dims, values)
                    self._keep(name, place)
            status = arrays[STATUS][1] if STATUS in arrays else broken
            self._arrays[STATUS][self._region(STATUS, place)] = status

    def _fitted(self, name: str, place: Mapping[str, slice], dims: tuple[str, ...], values: Any) -> Any:
        """Return values as long as the store has room behind the cases."""
        array = self._arrays[name]
        names = array.metadata.dimension_names
        values = np.moveaxis(values, [dims.index(dim) for dim in names], range(len(names)))
        room = tuple(
            place[dim].stop - place[dim].start if dim in place else n for dim, n in zip(names, array.shape, strict=True)
        )
        if values.shape == room:
            return values
        for dim, length, n in zip(names, values.shape, room, strict=True):
            if length > n:
                self.note(f"some curves have more than {n} values along {dim}; the first {n} of each are kept")
        out = np.full(room, array.fill_value, values.dtype)
        part = tuple(slice(min(pair)) for pair in zip(values.shape, room, strict=True))
        out[part] = values[part]
        return out

    def note(self, sentence: str) -> None:
        """Add a sentence to what the store says of its blocks."""
        before = str(self._group.attrs.get(NOTES, "")).splitlines()
        if sentence not in before:
            with self._told():
                self._group.attrs[NOTES] = "\n".join([*before, sentence])

    def finish(self, attrs: Mapping[str, Any], empty: Sequence[str], without: Sequence[str]) -> None:
        """Write attributes of a result that is complete, without some that it had, and without arrays that stayed empty."""
        with self._told():
            for name in empty:
                if name in self._arrays and self._arrays[name].nchunks_initialized == 0:
                    del self._group[name]
        kept = {key: value for key, value in self._group.attrs.items() if key not in {*without, UNFINISHED}}
        with self._told():
            self._group.attrs.put(kept | _plain(attrs))

    def _region(self, name: str, place: Mapping[str, slice]) -> tuple[slice, ...]:
        return tuple(place.get(dim, slice(None)) for dim in self._arrays[name].metadata.dimension_names)

    def _keep(self, name: str, place: Mapping[str, slice]) -> None:
        """Bring a chunk to the disk before the status says that it is there."""
        if self.folder is None:
            return
        array = self._arrays[name]
        numbers = [
            str(place[dim].start // length if dim in place else 0)
            for dim, length in zip(array.metadata.dimension_names, array.chunks, strict=True)
        ]
        with contextlib.suppress(FileNotFoundError), Path(self.folder, name, "c", *numbers).open("rb") as file:
            os.fsync(file.fileno())

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        """Turn what fails inside into a sentence."""
        try:
            yield
        except ResultError:
            raise
        except Exception as error:  # of zarr, or what writes the URL
            raise ResultError(
                f"the store {_name(self.path)} could not be written: {_said(error)}; the blocks that are done are kept"
            ) from error


def _zarr() -> Any:
    try:
        import zarr
        import zarr.codecs
    except ImportError:
        raise ParameterError("a store needs zarr, which is not installed: pip install 'dforce[maps]'") from None
    return zarr


def local_place(path: str | os.PathLike[str]) -> Path | None:
    """Return the path of what lies in the file system, also where a URL ``file://`` says so; None: another URL."""
    scheme, slashes, rest = str(path).partition("://")
    if not slashes:
        return Path(path)
    return Path(url2pathname(rest)) if scheme.lower() in ("file", "local") else None


def _is_there(url: str) -> bool:
    """Say whether there is a store at a URL.

    Raises
    ------
    ResultError
        When it cannot be reached, or the package that reaches such URLs is not installed.
    """
    try:
        import fsspec

        files, path = fsspec.core.url_to_fs(url)
        return bool(files.exists(f"{path.rstrip('/')}/zarr.json"))
    except ImportError as error:
        raise ResultError(f"{_name(url)} needs a package that is not installed: {_said(error)}") from None
    except Exception as error:  # of whatever reads the URL  # noqa: BLE001
        raise ResultError(f"{_name(url)} cannot be reached: {_said(error)}") from None


def _name(path: str | os.PathLike[str]) -> str:
    return f"'{shorten(str(path))}'"


def _said(error: Exception) -> str:
    return reason(error) if isinstance(error, OSError) else shorten(str(error) or type(error).__name__, 200)


def _plain(attrs: Mapping[str, Any]) -> dict[str, Any]:
    """Return attributes as JSON holds them."""
    return {
        str(key): value.tolist() if isinstance(value, np.ndarray | np.generic) else value
        for key, value in attrs.items()
    }
