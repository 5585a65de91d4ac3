"""Case files: read with care, written whole or not at all."""

from __future__ import annotations

import functools
import io
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from dforce import library
from dforce.case._case import NOT_TOML, Case
from dforce.case.paths import with_number
from dforce.core.errors import CaseError, DForceError, ParameterError, ResultError, checked, nearest, shorten
from dforce.core.files import beside, exists, read_input, text_of, write_whole
from dforce.core.toml import LONGEST
from dforce.forces import REGISTRY
from dforce.results import hdf5
from dforce.results.files import MOST_BYTES as MOST_BYTES_OF_RESULT
from dforce.results.files import is_whole
from dforce.results.provenance import FOLDER, check_plugins, folder_of_plugins
from dforce.results.store import is_store, open_store
from dforce.results.store_files import local_place

if TYPE_CHECKING:
    import xarray as xr


@checked
def example(name: str) -> Case:
    """Return a shipped case by its name, such as ``"figure-3-air"``.

    Raises
    ------
    ParameterError
        When no example has this name; the sentence contains the nearest name.
    """
    return Case.from_toml(library.example_text(name))


@checked
def load_case(path: str | os.PathLike[str]) -> Case:
    """Return the case in a case file (TOML) or in a result; without such a file, the shipped example of this name.

    Raises
    ------
    CaseError
        When the file cannot be read as a case; the sentence contains the reason, and the line of a mistake in TOML.
    ForceError
        When a plug-in of the case fails.
    """
    file = Path(path)
    if str(path) in library.examples() and not exists(file):
        return example(str(path))
    try:
        if is_store(path):
            place, attrs = local_place(path), open_store(path).attrs
            return _of_result(attrs, None if place is None else place.resolve().parent)
    except ResultError as error:
        raise CaseError(str(error)) from None
    try:
        content = read_input(path, "case", LONGEST, CaseError, larger={hdf5.START: MOST_BYTES_OF_RESULT})
    except CaseError as error:
        missing = str(error).startswith("there is no file")
        raise CaseError(f"{error}{_example_hint(file.name) if missing else ''}") from None
    try:
        if content.startswith(hdf5.START):
            return _of_result(_attributes(content), file.resolve().parent)
        with beside(file.resolve().parent):
            if file.suffix.lower() == ".nc":
                raise CaseError("the file is damaged or not a file of results")
            return Case.from_toml(text_of(content, "the file", CaseError))
    except (CaseError, ParameterError) as error:
        measured = str(error).startswith(NOT_TOML) and file.suffix.lower() != ".toml"
        hint = "; to read a measured curve type dforce read FILE" if measured else ""
        raise CaseError(f"{shorten(file.name, 100)}: {error}{hint}") from None


def case_of(result: xr.Dataset) -> Case:
    """Return the case that a result was computed from; of one case of a sweep, with the values of its parameters.

    Raises
    ------
    ParameterError
        When the result carries none.
    """
    return next(cases_of(result, [{}]))


def _name_of(path: str, result: xr.Dataset) -> str:
    return next((name for name in (path, path.rsplit(".", maxsplit=1)[-1]) if name in result.coords), "")


def cases_of(result: xr.Dataset, places: Iterable[Mapping[str, int]]) -> Iterator[Case]:
    """Give the cases of a sweep at places along its dimensions; dimensions that are left out keep the value of the case.

    Raises
    ------
    ParameterError
        When the result carries no case or has lost a value of its sweep, or a force model of a user's own has changed since.
    """
    try:
        case = _case_in(result).model_copy(update={"sweep": None})
    except DForceError as error:
        raise ParameterError(f"the result does not contain its case: {error}") from None
    check_plugins(case, result)
    names = {path: _name_of(path, result) for path in str(result.attrs.get("over", "")).split()}
    if lost := [path for path, name in names.items() if not name]:
        raise ParameterError(f"this part of a sweep has lost its value of {lost[0]}; choose it without drop=True")
    axes = [(path, result.variables[name]) for path, name in names.items()]
    for place in places:
        one = case
        for path, axis in axes:
            if set(axis.dims) <= set(place):
                value = axis.values[tuple(place[str(dim)] for dim in axis.dims)].item()
                is_number = "units" in axis.attrs  # of the instrument, the sample or a force: it was validated
                one = with_number(one, path, value) if is_number else one.replace(path, value)
        yield one


def _case_in(result: xr.Dataset) -> Case:
    """Return the case in a result, with the force models that the result was computed with."""
    text, place = str(result.attrs.get("case", "")), folder_of_plugins(result.attrs)
    case = _read(text) if place is None else None
    is_known = case is not None and all(REGISTRY.get(force.name) is type(force) for force in case.forces)
    if case is None or not is_known:  # a model may be defined anew
        with beside(place):
            case = Case.from_toml(text)
    return case


@functools.lru_cache(maxsize=64)
def _read(text: str) -> Case:
    """Return the case in the text of a result, which is asked for several times."""
    return Case.from_toml(text)


def _example_hint(name: str) -> str:
    hint = nearest(name.removesuffix(".toml")[:100], library.examples())
    return hint.replace("did you mean", "did you mean the example") if "did you mean" in hint else ""


def _of_result(attrs: Mapping[str, str], place: Path | None) -> Case:
    """Return the case in the attributes of a result; plug-ins are looked for beside it where their own folder is not here."""
    folder = folder_of_plugins(attrs)
    with beside(folder if folder is not None and folder.is_dir() else place):
        return Case.from_toml(attrs["case"])


def _attributes(content: bytes) -> dict[str, str]:
    """Return the texts among the attributes of a file of results."""
    import h5py

    damaged = CaseError("the file of results is damaged or cut off")
    if not is_whole(content):
        raise damaged
    try:
        with h5py.File(io.BytesIO(content), "r") as results:
            found = {name: results.attrs[name] for name in ("case", FOLDER) if name in results.attrs}
            texts = {name: one if isinstance(one, str) else bytes(one).decode() for name, one in found.items()}
    except Exception:  # as any error of h5py  # noqa: BLE001
        raise damaged from None
    if "case" not in texts:
        raise CaseError("the file of results contains no case")
    return texts


@checked
def save_case(case: Case, path: str | os.PathLike[str]) -> None:
    """Write a case file, whole or not at all.

    Raises
    ------
    CaseError
        When the file cannot be written.
    """
    try:
        write_whole(path, case.to_toml().encode())
    except ResultError as error:
        raise CaseError(str(error)) from None
