"""The files of a session: its document, written whole at each change, and its results with their names."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import re
import secrets
import threading
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import dforce as df
from dforce.core.errors import shorten
from dforce.core.files import write_whole
from dforce.core.notation import plain_math
from dforce.core.toml import read_toml
from dforce.gui.document.document import EDITED, LONGEST_NAME, MOST_RESULTS, NAMING, RESULT_COLORS, Document, KeptResult

if TYPE_CHECKING:
    import xarray as xr

log = logging.getLogger("dforce.gui")

KEY = "document"
SAVED_AFTER = 0.5  # s
TRIED_AGAIN = 5.0  # s after which a failed write is tried again

ASIDE = ".unread"  # ending of an unreadable file; it is kept, because no input is thrown away


class Store(dict[str, Any]):
    """A dict that a file keeps.

    Parameters
    ----------
    file
        Its file; it need not exist yet. An unreadable file is put aside.
    """

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.file = file
        try:
            found = json.loads(file.read_text(encoding="utf-8"))
            if not isinstance(found, dict):
                raise ValueError("no table")
            self.update(found)
        except FileNotFoundError:
            pass
        except (OSError, ValueError, RecursionError):
            with contextlib.suppress(
                OSError
            ):  # one that can be neither read nor moved cannot be written, which is said
                file.replace(file.with_suffix(ASIDE))

    def __setitem__(self, key: str, value: object) -> None:
        """Take a value, and write the file. Blocking.

        Raises
        ------
        ResultError
            When the file cannot be written; it is then as it was.
        """
        super().__setitem__(key, value)
        try:
            self.file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_whole(self.file, json.dumps(dict(self)).encode())
            self.file.chmod(0o600)
        except (OSError, ValueError, TypeError, RecursionError, df.ResultError) as error:
            raise df.ResultError(why(error)) from error


def why(error: BaseException) -> str:
    """Return in words why a file could not be written, without its place: on a server that is nobody's business."""
    cause = error.__cause__ if isinstance(error, df.DForceError) and error.__cause__ is not None else error
    if isinstance(cause, OSError):
        return (cause.strerror or str(cause)).lower()
    return str(error)


IDENTIFIER = re.compile(r"[0-9a-f]{16}")
MOST_BYTES = 500_000_000  # of a session


class Saving:
    """Keeps a document in a store, at most twice a second while it changes.

    Parameters
    ----------
    store
        The store, with the document under :data:`KEY`.
    current
        Returns the document.
    tell
        Called when `unkept` has changed.

    Attributes
    ----------
    unkept
        Why the input is not kept; empty while it is.
    """

    def __init__(
        self, store: MutableMapping[str, object], current: Callable[[], Document], tell: Callable[[], None]
    ) -> None:
        self._store, self._current, self._tell = store, current, tell
        self._timer: asyncio.TimerHandle | None = None
        self._writing = threading.Lock()
        self.unkept = ""

    @property
    def waits(self) -> bool:
        """Whether something is still to be written."""
        return self._timer is not None

    def soon(self, seconds: float = SAVED_AFTER) -> None:
        """Write the document after a moment."""
        if self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(seconds, self._save)

    def write(self) -> None:
        """Write the document as it is now. Blocking."""
        with self._writing:
            plain = self._current().to_plain()
            Document.from_plain(plain)  # an unreadable document must not replace a readable one
            self._store[KEY] = plain

    def end(self) -> None:
        """Write a waiting document, and nothing more: the server ends. Blocking."""
        if self._timer is not None:
            self._timer.cancel()
            try:
                self.write()
            except df.ResultError as error:
                log.error("the last input could not be kept: %s", error)

    def _save(self) -> None:
        self._timer = None
        asyncio.get_running_loop().run_in_executor(None, self.write).add_done_callback(self._saved)

    def _saved(self, written: asyncio.Future[None]) -> None:
        """Note whether the document was written, and try again if not."""
        if written.cancelled():
            return
        error = written.exception()
        if error is not None and not isinstance(error, df.ResultError):
            log.error("your input could not be kept", exc_info=error)
        unkept = "" if error is None else f"Your input is not kept: {error}. Save the case (menu File)."
        if error is not None:
            self.soon(TRIED_AGAIN)
        if unkept != self.unkept:
            self.unkept = unkept
            self._tell()


class ResultStore:
    """The results of one session, in its own folder.

    Parameters
    ----------
    folder
        Their folder; it is made for the first result.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def keep(self, result: xr.Dataset) -> str:
        """Write a result and return its identifier; the oldest ones go when there are too many. Blocking.

        Raises
        ------
        ResultError
            When it cannot be written; no other result has gone then.
        """
        name = secrets.token_hex(8)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            df.write(result, self.folder / f"{name}.nc")
        except OSError as error:
            raise df.ResultError(why(error)) from error
        self._forget()
        return name

    def take(self, name: str) -> xr.Dataset:
        """Return a result. Blocking.

        Raises
        ------
        ResultError
            When there is none of this identifier, or it cannot be read.
        """
        return df.read(self.path(name))

    def path(self, name: str) -> Path:
        """Return the file of a result.

        Raises
        ------
        ResultError
            When there is none of this identifier.
        """
        path = self.folder / f"{name}.nc"
        if not IDENTIFIER.fullmatch(name) or not path.is_file():
            raise df.ResultError(f"the result '{shorten(name, 20)}' is no longer kept")
        return path

    def names(self) -> list[str]:
        """Return the identifiers, the oldest first."""
        return [file.stem for file in self._files()]

    def drop(self, name: str) -> None:
        """Forget a result."""
        self.path(name).unlink(missing_ok=True)

    def _files(self) -> list[Path]:
        return sorted(self.folder.glob("*.nc"), key=lambda file: file.stat().st_mtime)

    def _forget(self) -> None:
        files = self._files()
        sizes = [file.stat().st_size for file in files]
        while len(files) > 1 and (len(files) > MOST_RESULTS or sum(sizes) > MOST_BYTES):
            files.pop(0).unlink(missing_ok=True)
            sizes.pop(0)


NOT_COMPARED = (*NAMING, "plugins")
NOTHING = "–"
LONGEST_VALUE = 60
IN_A_NAME = 2  # differences that make a name; more make none that can be read


@dataclass(frozen=True)
class Difference:
    """A parameter in which results differ: its path, words and symbol, and the value of each result as text."""

    path: str
    label: str
    symbol: str
    values: tuple[str, ...]


def differences(results: Sequence[xr.Dataset]) -> list[Difference]:
    """Return the parameters in which the cases of results differ, in the order of a case file."""
    cases = [_values(str(result.attrs.get("case", ""))) for result in results]
    paths = dict.fromkeys(path for case in cases for path in case)
    found = []
    for path in paths:
        values = tuple(case.get(path, NOTHING) for case in cases)
        if len(set(values)) > 1:
            owner = next(result for result, case in zip(results, cases, strict=True) if path in case)
            found.append(Difference(path, *_words(owner, path), values))
    return found


def name_of(result: xr.Dataset, last: xr.Dataset | None, taken: Sequence[str]) -> str:
    """Return a name for a result that distinguishes it from the last: the difference, or the title with a number."""
    title = str(result.attrs.get("title", "")) or "Result"
    if last is not None and _original(last) == _original(result):
        rows = differences([last, result])
        if 0 < len(rows) <= IN_A_NAME:
            title = ", ".join(f"{plain_math(row.symbol) or row.label} = {row.values[1]}" for row in rows)
    name, number = shorten(title, LONGEST_NAME - 6), 1
    while name in taken:
        number += 1
        name = f"{shorten(title, LONGEST_NAME - 6)} ({number})"
    return name


def _original(result: xr.Dataset) -> str:
    """Return the title of a result before its case was edited."""
    return str(result.attrs.get("title", "")).removesuffix(EDITED)


def color_of(others: Sequence[KeptResult]) -> int:
    """Return the color that the fewest of the results have."""
    used = [kept.color for kept in others]
    return min(RESULT_COLORS[1:], key=lambda color: (used.count(color), color))


def _values(toml: str) -> dict[str, str]:
    """Return the parameters of a case by path, as the texts that its file holds."""
    try:
        table = read_toml(toml)
    except ValueError:
        return {}
    return {path: value for path, value in _flat("", table) if path.partition(".")[0] not in NOT_COMPARED}


def _flat(path: str, value: object) -> Iterator[tuple[str, str]]:
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _flat(f"{path}.{key}" if path else str(key), inner)
    elif isinstance(value, list) and value and isinstance(value[0], Mapping):
        names = [str(item.get("model", "")) for item in value]
        for number, (name, inner) in enumerate(zip(names, value, strict=True), start=1):
            yield from _flat(f"{path}.{name if name and names.count(name) == 1 else number}", inner)
    elif isinstance(value, list):
        yield path, shorten(", ".join(map(str, value)), LONGEST_VALUE)
    else:
        yield path, shorten(str(value), LONGEST_VALUE)


def _words(result: xr.Dataset, path: str) -> tuple[str, str]:
    """Return the words and the symbol that are declared for a parameter; its path where it is no quantity."""
    try:
        quantity = df.Case.from_toml(str(result.attrs["case"])).quantity(path)
    except (df.DForceError, TypeError, KeyError):
        return path.rpartition(".")[2].replace("_", " "), ""
    return quantity.doc.partition(";")[0].partition(":")[0], quantity.symbol
