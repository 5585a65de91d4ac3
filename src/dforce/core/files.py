"""Files of users: read by one opener, within a limit; written whole or not at all, put in their place in one step."""

from __future__ import annotations

import contextlib
import io
import os
import re
import secrets
import stat
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from pathlib import Path

from dforce.core.errors import DForceError, ParameterError, ResultError, checked, shorten

READ_ONLY = sum(getattr(os, flag, 0) for flag in ("O_RDONLY", "O_BINARY", "O_CLOEXEC", "O_NOCTTY", "O_NONBLOCK"))
CHUNK = 65_536  # bytes that are read at once where the system gives no size
SUFFIXES = (".nc", ".csv")  # of results
FOR_GUESTS = "is a file on the server, and guests may not read it; type its values in the case"
TEMPORARY = re.compile(r"\.dforce-[0-9a-f]{16}\.tmp")
PAUSES = (0.02, 0.1, 0.5)  # s between tries to replace a file
ABANDONED = 3600.0  # s after which a temporary file has no writer any more, on a system without locks

guests_only = False  # whether this process answers guests, whose cases may read no file of this computer

_folder: ContextVar[Path | None] = ContextVar("folder", default=None)
_noted: ContextVar[list[Path] | None] = ContextVar("noted", default=None)


@contextlib.contextmanager
def beside(folder: str | os.PathLike[str] | None) -> Iterator[None]:
    """Look for the files that a case names in this folder, while the context lasts; None: in the working directory."""
    token = _folder.set(None if folder is None else Path(folder))
    try:
        yield
    finally:
        _folder.reset(token)


@contextlib.contextmanager
def noted() -> Iterator[list[Path]]:
    """Give a list that takes up each file which a case names while the context lasts."""
    files: list[Path] = []
    token = _noted.set(files)
    try:
        yield files
    finally:
        _noted.reset(token)


def folder() -> Path:
    """Return the folder that the files of a case are looked for in at this moment."""
    return _folder.get() or Path.cwd()


def read_input(
    path: str | os.PathLike[str],
    noun: str,
    most_bytes: int,
    error: type[DForceError],
    *,
    name: str = "",
    larger: Mapping[bytes, int] | None = None,
) -> bytes:
    """Return the bytes of a file that a user gave: a regular file, or a link to one, no larger than its kind may be.

    Parameters
    ----------
    path
        The file.
    noun
        The kind of file, for the message on a file that is too large: ``"case"``.
    most_bytes
        The largest size of this kind; no more than that is read.
    error
        The error that is raised.
    name
        Name of the file in messages; left out: its path in quotes.
    larger
        The largest sizes of files that begin in other ways.

    Raises
    ------
    DForceError
        The class `error`, with one sentence: no such file, a folder, a device or pipe, too large, or not readable.
    """
    missing = error(f"{name}: there is no such file" if name else f"there is no file {in_quotes(path)}")
    name = name or in_quotes(path)
    try:
        descriptor = os.open(path, READ_ONLY)
        with os.fdopen(descriptor, "rb", buffering=0) as file:
            status = os.fstat(descriptor)
            if stat.S_ISDIR(status.st_mode):
                raise error(f"{name} is a folder, not a file")
            if not stat.S_ISREG(status.st_mode):
                raise error(f"{name} is not an ordinary file: dForce does not read devices and pipes")
            parts = [file.read(min(CHUNK, most_bytes + 1)) or b""]
            most_bytes = next(
                (most for start, most in (larger or {}).items() if parts[0].startswith(start)), most_bytes
            )
            left = most_bytes + 1 - len(parts[0])
            while left > 0 and status.st_size <= most_bytes and parts[-1]:  # some files of the system have no size
                parts.append(file.read(min(left, max(status.st_size, CHUNK))) or b"")
                left -= len(parts[-1])
            if left <= 0 or status.st_size > most_bytes:
                raise error(f"{name} is larger than {_in_bytes(most_bytes)}, the limit for a {noun}")
    except FileNotFoundError:
        raise missing from None
    except DForceError:
        raise
    except (OSError, ValueError) as failed:
        # Windows answers "permission denied"; the method of Path fails in a folder that may not be searched
        is_folder = isinstance(failed, OSError) and os.path.isdir(path)  # noqa: PTH112
        raise error(
            f"{name} {'is a folder, not a file' if is_folder else f'cannot be read: {reason(failed)}'}"
        ) from None
    return b"".join(parts)


def text_of(content: bytes, name: str, error: type[DForceError]) -> str:
    """Return the text of a file, whose `name` a message gives as it is.

    Raises
    ------
    DForceError
        The `error`, when the bytes are not text in UTF-8.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise error(
            f"{name} is not text in UTF-8; if it is text, save it in the editor with the encoding UTF-8"
        ) from None


def in_quotes(path: str | os.PathLike[str]) -> str:
    """Return the name of a file, for a sentence."""
    return f"'{shorten(str(path), 200)}'"


def _in_bytes(size: int) -> str:
    """Return a size in words."""
    for scale, unit in ((1_000_000_000, "GB"), (1_000_000, "MB"), (1000, "kB")):
        if size >= scale:
            return f"{size / scale:g} {unit}"
    return f"{size} bytes"


def named(path: str | os.PathLike[str], key: str, beside: Path | None = None) -> Path:
    """Return the file that a case names under a key, in the folder given or the one of this moment.

    Every file that a case names is found here.

    Raises
    ------
    ParameterError
        Where the case is a guest's; the sentence is the same whether the file exists or not.
    """
    if guests_only:
        raise ParameterError(f"{key} {FOR_GUESTS}")
    file = (beside or folder()) / path
    files = _noted.get()
    if files is not None:
        files.append(file)
    return file


def exists(path: Path) -> bool:
    """Return whether a file or folder exists; none has a name that the system refuses."""
    try:
        return path.exists()
    except OSError:  # longer than a name may be
        return False


@checked
def check_target(
    path: str | os.PathLike[str], suffixes: Sequence[str] = SUFFIXES, spare: Iterable[os.PathLike[str]] = ()
) -> Path:
    """Return the path of a file to be written, after checking that it can be.

    Raises
    ------
    ResultError
        When the ending is none of `suffixes`, the folder does not exist, or the path may not be replaced, such as a
        source of the result in `spare`.
    """
    target, name = Path(path), f"'{shorten(str(path))}'"
    if target == Path():
        raise ResultError(f"the name of the file to write is empty; use a name ending in {', '.join(suffixes)}")
    if target.suffix.lower() not in suffixes:
        ending = f"ends in '{shorten(target.suffix, 20)}'" if target.suffix else "has no ending"
        raise ResultError(f"{name} {ending}; use a name ending in {', '.join(suffixes)}")
    try:
        folder = target.resolve().parent
        if not folder.is_dir():
            raise ResultError(f"{name} cannot be written: there is no folder '{shorten(str(folder))}'; create it first")
        taken = target.exists()
        if taken and not target.is_file():
            raise ResultError(f"{name} cannot be written: it is not a file")
        if taken and any(Path(one).exists() and target.samefile(one) for one in spare):
            raise ResultError(f"{name} is the input, and would be lost; write another name for the result")
        if not os.access(target if taken else folder, os.W_OK):
            raise ResultError(f"{name} cannot be written: you have no permission to write it")
    except ResultError:
        raise
    except (OSError, ValueError) as error:
        raise ResultError(f"{name} cannot be written: {reason(error)}") from None
    return target


def reason(error: OSError | ValueError) -> str:
    """Return why the system refused a file, in its own words."""
    return ((error.strerror if isinstance(error, OSError) else None) or str(error)).lower()


@checked
def write_whole(
    path: str | os.PathLike[str], content: bytes | memoryview, *, overwrite: bool = True, sync_folder: bool = True
) -> None:
    """Write a file whole or not at all.

    After a failure, Ctrl-C or a power cut `path` is as before. The temporary file of a process that was killed while
    writing is removed. With `sync_folder` off, a power cut soon after may undo the whole write.

    Raises
    ------
    ResultError
        When the file cannot be written.
    FileExistsError
        When `overwrite` is off and `path` exists.
    """
    try:
        target = Path(os.path.realpath(path))  # a link stays a link
        with _temporary(target.parent) as (temporary, file):
            _remove_abandoned(temporary)
            if target.exists():
                temporary.chmod(stat.S_IMODE(target.stat().st_mode))
            _fill(file, content)
            if os.name != "posix":
                file.close()  # Windows moves no file that is open
            if overwrite:
                put_in_place(temporary, target)
            else:
                _move_beside(temporary, target)
            if sync_folder:
                _sync_folder(target.parent)
    except FileExistsError:
        raise
    except (OSError, ValueError) as error:
        is_open = isinstance(error, PermissionError) and os.path.isfile(path)  # noqa: PTH113 see above
        remedy = "; close it in other programs" if is_open else ""
        raise ResultError(f"'{shorten(str(path))}' could not be written: {reason(error)}{remedy}") from error


def put_in_place(temporary: Path, target: Path) -> None:
    """Replace a file by a new one; on Windows a virus scanner may hold one of them for a moment, so this tries again.

    Raises
    ------
    OSError
        When it cannot be done.
    """
    for pause in PAUSES:
        with contextlib.suppress(PermissionError):
            temporary.replace(target)
            return
        time.sleep(pause)
    temporary.replace(target)


@contextlib.contextmanager
def _temporary(folder: Path) -> Iterator[tuple[Path, io.FileIO]]:
    """Give a new file of a folder, locked while it is written; at the end it is removed if it still exists."""
    path = folder / f".dforce-{secrets.token_hex(8)}.tmp"
    file = _locked(path)
    try:
        yield path, file
    finally:
        file.close()
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)


def _locked(path: Path) -> io.FileIO:
    while True:
        file = io.FileIO(path, "x")  # the user's umask applies
        _lock(file)
        if os.name != "posix" or os.fstat(file.fileno()).st_nlink:
            return file
        file.close()  # another process took it for abandoned before it was locked


def _fill(file: io.FileIO, content: bytes | memoryview) -> None:
    left = memoryview(content)
    while left:
        left = left[file.write(left) or 0 :]
    os.fsync(file.fileno())


def _lock(file: io.FileIO) -> bool | None:
    """Lock a file for as long as it is open; False if another process has the lock, None if the system has no locks."""
    try:
        import fcntl
    except ImportError:  # Windows, where a file that is open cannot be removed
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def _remove_abandoned(mine: Path) -> None:
    """Remove the temporary files beside `mine` that a process killed while writing has left."""
    with contextlib.suppress(OSError):  # a folder that may be written, but not read
        now = mine.stat().st_mtime  # by the clock of this file system
        found = [entry for entry in os.scandir(mine.parent) if TEMPORARY.fullmatch(entry.name)]
        for entry in found:
            with contextlib.suppress(OSError):  # another user's, or gone in this moment
                if entry.name != mine.name and entry.is_file(follow_symlinks=False):
                    _remove_if_abandoned(Path(entry.path), now)


def _remove_if_abandoned(path: Path, now: float) -> None:
    with io.FileIO(path) as file:
        free, age = _lock(file), now - os.fstat(file.fileno()).st_mtime
        if free:
            path.unlink()  # while it is locked: a writer that has just made it notices
    if free is None and age > ABANDONED:
        path.unlink()


def _sync_folder(folder: Path) -> None:
    """Bring a new name to the disk; the file is in its place already, so a system that cannot do this does no harm."""
    if os.name != "posix":
        return
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
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
