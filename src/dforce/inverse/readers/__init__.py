"""Readers of files of measured curves: one file, one maker.

dForce finds the readers in this folder: a new maker needs only a new file with a :class:`~dforce.inverse.table.Reader` named
``READER``. Readers of other packages follow, by their entry points in the group "dforce.readers".
"""

from __future__ import annotations

import importlib
import os
import pkgutil

from dforce.core.entries import loaded
from dforce.core.errors import ResultError
from dforce.core.files import in_quotes, read_input
from dforce.inverse.table import MeasuredTable, Reader

MOST_BYTES = 1_000_000_000  # of a file of curves
READERS: list[Reader] = [
    *(
        importlib.import_module(f"{__name__}.{file.name}").READER
        for file in pkgutil.iter_modules(__path__)
        if not file.name.startswith("_")
    ),
    *loaded("dforce.readers", Reader, "reader of measured files"),
]


def content_of(path: str | os.PathLike[str]) -> tuple[bytes, str]:
    """Return the bytes of a file, and its name for a sentence.

    Raises
    ------
    ResultError
        When it cannot be read, or is empty.
    """
    return read_input(path, "file of measured curves", MOST_BYTES, ResultError), in_quotes(path)


def tables_in(content: bytes, name: str) -> list[MeasuredTable]:
    """Return the curves in a file, by its content and not by its name.

    Raises
    ------
    ResultError
        For a file that cannot be read, with the remedy if known.
    """
    if not content.strip():
        raise ResultError(f"{name} is empty")
    for reader in READERS:
        for start, sentence in reader.not_read.items():
            if content.startswith(start):
                raise ResultError(f"{name} {sentence}")
    for reader in sorted(READERS, key=lambda one: not one.maker):  # the makers' before formats of many programs
        if reader.is_one(content):
            return reader.tables(content, name)
    raise ResultError(f"{name} is neither text nor a known kind of file; export the curve as text in UTF-8")


def endings() -> tuple[str, ...]:
    """Return the endings of files of measured curves, without dForce's own results."""
    return tuple(dict.fromkeys(ending for one in READERS if one.maker != "dForce" for ending in one.endings))


def sorted_readers() -> list[Reader]:
    """Return the readers as a page lists them: formats of many programs first, then the makers'."""
    return sorted(READERS, key=lambda one: (bool(one.maker), str(one)))


def in_words() -> str:
    """Return the kinds of files that are read, for a sentence."""
    words = [f"{one} ({', '.join(one.endings)})" for one in sorted_readers()]
    return f"{', '.join(words[:-1])} and {words[-1]}"
