"""Files of a session: its document, written whole at each change, its results under identifiers, and the files opened last."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import datetime
import json
import logging
import re
import secrets
import threading
from collections.abc import Callable, MutableMapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import dforce as df
from dforce.core.errors import shorten
from dforce.core.files import write_whole
from dforce.gui.document.document import MOST_RESULTS, Document

if TYPE_CHECKING:
    import xarray as xr

log = logging.getLogger("dforce.gui")

KEY = "document"
SAVED_AFTER = 0.5  # s
TRIED_AGAIN = 5.0  # s after which what could not be kept is written once more

ASIDE = ".unread"  # ending of what could not be read; it is kept, for nothing typed is thrown away


class Store(dict[str, Any]):
    """A dict that a file keeps.

    Parameters
    ----------
    file
        Where it is kept; it need not be there yet. One that cannot be read is put aside.
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
        Where it is kept, under :data:`KEY`.
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
            self._store[KEY] = self._current().to_plain()

    def end(self) -> None:
        """Write what waits, and nothing more: the server ends. Blocking."""
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
        """Say whether the document was written, and try again where it was not."""
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
    """The results of one session, in a folder of its own.

    Parameters
    ----------
    folder
        Where they lie; it is made when the first one comes.
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


LAST = (
    "last"  # the folder of the files opened last, in that of a session: a browser cannot open a file again by its name
)
MOST_LAST = 6
MOST_LAST_BYTES = 100_000_000  # of all of them
LONGEST_NAME = 180  # bytes of a name; a longer one keeps its end


@dataclass(frozen=True)
class LastFile:
    """A file that was opened: its name, and when (s since 1970)."""

    name: str
    opened: float

    def words(self, now: datetime.datetime) -> str:
        """Return its name with the day, or the time of today."""
        at = datetime.datetime.fromtimestamp(self.opened)
        days = (now.date() - at.date()).days
        when = f"{at:%H:%M}" if days == 0 else "yesterday" if days == 1 else f"{at.day} {at:%b}"
        return f"{shorten(self.name, 40)} ({when})"


class LastFiles:
    """The files of one session; one that is opened again takes the place of its earlier content.

    Parameters
    ----------
    folder
        Where they are kept; it is made when the first one comes.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def keep(self, data: bytes, name: str) -> None:
        """Keep a file; the oldest ones go when there are too many. Blocking.

        Raises
        ------
        ResultError
            When it cannot be written.
        """
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._path(name).write_bytes(data)
            sizes = [path.stat().st_size for path in self._paths()]
            for number, path in enumerate(self._paths()):
                if number and (number >= MOST_LAST or sum(sizes[: number + 1]) > MOST_LAST_BYTES):
                    path.unlink(missing_ok=True)
        except OSError as error:
            raise df.ResultError(f"the file is open, but cannot be listed for the next time: {why(error)}") from error

    def take(self, name: str) -> bytes:
        """Return a file. Blocking.

        Raises
        ------
        ResultError
            When it is no longer kept.
        """
        try:
            return self._path(name).read_bytes()
        except OSError:
            raise df.ResultError(
                f"the file '{shorten(name, 60)}' is no longer kept here; open it from your disk"
            ) from None

    def listed(self) -> list[LastFile]:
        """Return the files, the last one first."""
        return [LastFile(_name_of(path), path.stat().st_mtime) for path in self._paths()]

    def forget(self) -> None:
        """Remove all of them."""
        for path in self._paths():
            path.unlink(missing_ok=True)

    def _path(self, name: str) -> Path:
        cut = name.encode(errors="replace")[-LONGEST_NAME:].decode(errors="ignore")
        return self.folder / f"file-{base64.urlsafe_b64encode(cut.encode()).decode('ascii')}"

    def _paths(self) -> list[Path]:
        return sorted(self.folder.glob("file-*"), key=lambda path: path.stat().st_mtime, reverse=True)


def list_opened(session: Path, file: Path) -> None:
    """List a file of this computer that was named at the start; one that is gone or too large is not listed. Blocking."""
    with contextlib.suppress(OSError, df.ResultError):
        if file.stat().st_size <= MOST_LAST_BYTES:
            LastFiles(session / LAST).keep(file.read_bytes(), file.name)


def _name_of(path: Path) -> str:
    return base64.urlsafe_b64decode(path.name.removeprefix("file-")).decode(errors="replace")
