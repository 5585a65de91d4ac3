"""Case files: read with care, written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from dforce import library, plugins
from dforce.case._case import MOST_BYTES, Case
from dforce.errors import CaseError, ParameterError, ResultError, nearest, shorten
from dforce.results import whole_file

HDF5 = b"\x89HDF\r\n\x1a\n"  # how a file of results starts


def example(name: str) -> Case:
    """Return a shipped case by its name, such as ``"figure-3-air"``.

    Raises
    ------
    ParameterError
        When there is no example of this name; the sentence holds the nearest one.
    """
    return Case.from_toml(library.example_text(name))


def load_case(path: str | os.PathLike[str]) -> Case:
    """Return the case in a file: a TOML case file, or the case that a file of results was computed from.

    Raises
    ------
    CaseError
        When the file cannot be read as a case; the sentence says why, and where.
    """
    file = Path(path)
    name = shorten(str(path), 200)
    try:
        if file.is_dir():
            raise CaseError(f"'{name}' is a directory, not a case file")
        if file.exists() and not file.is_file():
            raise CaseError(f"'{name}' is not an ordinary file")
        if not file.is_file():
            raise CaseError(f"there is no file '{name}'{_example_hint(file.name)}")
        with file.open("rb") as stream:
            content = stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise CaseError(f"'{name}' cannot be read: {error.strerror or error}") from None
    try:
        with plugins.beside(file.resolve().parent):
            if content.startswith(HDF5):
                return Case.from_toml(_case_of_results(file))
            if file.suffix.lower() == ".nc":
                raise CaseError("the file is damaged, or no file of results: it does not begin like one")
            if len(content) > MOST_BYTES:
                raise CaseError(f"the file is larger than {MOST_BYTES // 1000} kB, so it is not a case")
            return Case.from_toml(content.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise CaseError(f"'{name}' is not a text file in UTF-8") from None
    except (CaseError, ParameterError) as error:
        raise CaseError(f"{shorten(file.name, 100)}: {error}") from None


def _example_hint(name: str) -> str:
    hint = nearest(name.removesuffix(".toml")[:100], library.examples())
    return hint.replace("did you mean", "did you mean the example") if "did you mean" in hint else ""


def _case_of_results(file: Path) -> str:
    import h5py

    try:
        with h5py.File(file, "r") as results:
            text = results.attrs["case"]
    except OSError:
        raise CaseError("the file of results is damaged or cut off") from None
    except KeyError:
        raise CaseError("the file of results holds no case") from None
    return text if isinstance(text, str) else bytes(text).decode("utf-8")


def save_case(case: Case, path: str | os.PathLike[str]) -> None:
    """Write a case file, whole or not at all.

    Raises
    ------
    CaseError
        When the file cannot be written.
    """
    try:
        with whole_file(path) as file:
            file.write_text(case.to_toml(), encoding="utf-8")
    except ResultError as error:
        raise CaseError(str(error)) from None
