"""Stores of large results: zarr, in blocks of cases, each compared with its checksum when it is read."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.errors import ParameterError, ResultError, shorten
from dforce.core.files import reason
from dforce.core.quantities import OBSERVABLES
from dforce.results.seal import COPY, KEY, ROOT, Seal, attributes_in, damage, sealed, unsealed
from dforce.results.store_files import StoreFiles, said

if TYPE_CHECKING:
    import xarray as xr

SUFFIX = ".zarr"
UNFINISHED = "interrupted"  # attribute of a store until all its blocks are written
BEING_MADE = "dforce_being_made"  # attribute by which an earlier dForce knew a store whose arrays were not all there


def is_store(path: str | os.PathLike[str]) -> bool:
    """Return whether a path names a store: a folder that ends in ``.zarr``, or a URL."""
    return str(path).rstrip("/").lower().endswith(SUFFIX)


def check_store(path: str | os.PathLike[str], resume: bool) -> None:
    """Check that a store can be made at a path, or is there to go on with.

    Raises
    ------
    ResultError
        When the ending is not ``.zarr``, there is no such folder to make it in, something is there already, or nothing is
        to go on with.
    """
    zarr_package()
    files = StoreFiles(path)
    if not is_store(path):
        raise ResultError(f"{files.name} is not the name of a store: it must end in '{SUFFIX}'")
    try:
        if files.folder is not None and not files.folder.parent.is_dir():
            parent = shorten(str(files.folder.parent))
            raise ResultError(f"{files.name} cannot be written: there is no folder '{parent}'; create it first")
        there = _is_there(files)
    except ResultError:
        raise
    except (OSError, ValueError) as error:
        raise ResultError(f"{files.name} cannot be written: {reason(error)}") from None
    if there and not resume:
        raise ResultError(f"{files.name} exists already; continue it (resume), or choose another name")
    if resume and not there:
        raise ResultError(f"there is no store {files.name} to continue")


def open_store(path: str | os.PathLike[str]) -> xr.Dataset:
    """Return the result in a store; its numbers are read, and compared with their checksums, when they are asked for.

    Raises
    ------
    ResultError
        When there is no such store, it was not written by dForce or has no checksums, or its attributes or coordinates are
        damaged. Numbers of the result raise it where their chunk is missing or not as it was written.
    """
    import xarray as xr

    zarr_package()
    from dforce.results.checked import Checked  # which needs zarr

    files = StoreFiles(path)
    attributes, seal = read_root(files)
    once = whole_files(files, seal)
    for key in seal.files:
        if key not in once:
            raise ResultError(damage(files.name, key, files.read([key]).get(key)))
    store = Checked(files, seal, {ROOT: sealed(attributes, seal)} | once, finished=UNFINISHED not in attributes)
    try:
        data: xr.Dataset = xr.open_zarr(store, chunks=None, consolidated=False, decode_times=False)
    except ResultError:
        raise
    except Exception as error:  # of zarr or xarray  # noqa: BLE001
        raise ResultError(f"{files.name} cannot be read as a store: {said(error)}") from None
    words = {
        key: coord.copy(data=np.array(coord.values.tolist(), dtype=np.str_))
        for key, coord in data.coords.items()
        if coord.dtype.kind in "OT" and coord.ndim == 1
    }
    order = [name for name in OBSERVABLES if name in data]  # a folder has none
    data = data[[*order, *sorted(str(name) for name in data.data_vars if name not in order)]]
    data = data.assign_coords(words)
    del data.attrs[KEY]
    return data


def read_root(files: StoreFiles) -> tuple[dict[str, Any], Seal]:
    """Return the attributes of a store and its seal.

    Raises
    ------
    ResultError
        When there is no store, it was not written by dForce or has no checksums, or its attributes or their copy are damaged.
    """
    there = files.read([ROOT, COPY])
    if not there and not _is_there(files):
        raise ResultError(f"there is no store {files.name}")
    found = unsealed(there.get(ROOT))
    for key in (ROOT, COPY):
        if unsealed(there.get(key)) is None and (found is not None or COPY in there):
            raise ResultError(damage(files.name, key, there.get(key)))
    if found is not None:
        return found
    try:
        attributes = attributes_in(there.get(ROOT, b"{}"))
    except ValueError:
        attributes = {}
    if BEING_MADE in attributes or "dforce_version" in attributes:
        raise ResultError(
            f"{files.name} has no checksums: an earlier dForce or another program wrote it; "
            "compute it again, or read it unchecked with xarray.open_zarr"
        )
    raise ResultError(f"{files.name} is not a store of dForce, or is incomplete")


def whole_files(files: StoreFiles, seal: Seal) -> dict[str, bytes]:
    """Return the files of a store that are written once, without missing or changed files."""
    found = files.read(seal.files)
    return {key: content for key, content in found.items() if seal.is_whole(key, content)}


def zarr_package() -> Any:
    """Return zarr.

    Raises
    ------
    ParameterError
        When it is not installed.
    """
    try:
        import zarr
        import zarr.codecs
    except ImportError:
        raise ParameterError('a store needs zarr, which is not installed: pip install "dforce[maps]"') from None
    return zarr


def _is_there(files: StoreFiles) -> bool:
    return files.folder.exists() if files.folder is not None else bool(files.read([ROOT, COPY]))
