"""The files of a store by their keys, such as ``amplitude/c/0``: in a folder, or at a URL of fsspec."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.request import url2pathname

from dforce.core.errors import ResultError, shorten
from dforce.core.files import read_input, reason, write_whole

if TYPE_CHECKING:
    import fsspec

MOST_BYTES = 2_000_000_000  # of a file of a store


class StoreFiles:
    """The files of a store; each is written whole or not at all.

    Attributes
    ----------
    name
        The store as sentences name it.
    folder
        Its folder, where links lead to; None for a store at another URL.

    Raises
    ------
    ResultError
        In any method, when the store cannot be reached, or the package that reaches such URLs is not installed.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.name = f"'{shorten(str(path))}'"
        place = local_place(path)
        self.url = str(path)
        try:
            self.folder = None if place is None else Path(os.path.realpath(place))
        except ValueError as error:  # a zero in its name
            raise ResultError(f"{self.name} cannot be reached: {reason(error)}") from None

    def read(self, keys: Iterable[str]) -> dict[str, bytes]:
        """Return the contents of some files, without missing files."""
        keys = list(keys)
        if self.folder is not None:
            return dict(self._read_local(self.folder, keys))
        system, root = self._remote()
        found = system.cat_ranges([f"{root}/{key}" for key in keys], None, None) if keys else []
        for content in found:
            if isinstance(content, Exception) and not isinstance(content, FileNotFoundError):
                raise self._lost(content)
        return {key: content for key, content in zip(keys, found, strict=True) if isinstance(content, bytes)}

    def _read_local(self, folder: Path, keys: Iterable[str]) -> Iterator[tuple[str, bytes]]:
        for key in keys:
            place = folder / key
            if os.path.lexists(place):
                yield key, read_input(place, "part of a store", MOST_BYTES, ResultError, name=f"{self.name}, {key}")

    def write(self, files: Mapping[str, bytes]) -> None:
        """Write files, in their order where they lie in a folder.

        Raises
        ------
        OSError
            When the system refuses.
        """
        if self.folder is None:
            system, root = self._remote()
            system.pipe({f"{root}/{key}": content for key, content in files.items()})
            return
        for key, content in files.items():
            place = self.folder / key
            place.parent.mkdir(parents=True, exist_ok=True)
            try:
                write_whole(place, content, sync_folder=False)  # checksums find the writes that a power cut undoes
            except ResultError as error:
                raise error.__cause__ or error from None

    def remove(self, keys: Iterable[str]) -> None:
        """Remove files, as far as they are there."""
        for key in self.read(keys):
            if self.folder is not None:
                (self.folder / key).unlink(missing_ok=True)
                with contextlib.suppress(OSError):  # it holds other files
                    (self.folder / key).parent.rmdir()
            else:
                system, root = self._remote()
                system.rm_file(f"{root}/{key}")

    def all_keys(self) -> list[str]:
        """Return the keys of all files."""
        if self.folder is not None:
            return [file.relative_to(self.folder).as_posix() for file in self.folder.rglob("*") if not file.is_dir()]
        system, root = self._remote()
        return [path.removeprefix(root).lstrip("/") for path in system.find(root)]

    def _remote(self) -> tuple[fsspec.AbstractFileSystem, str]:
        try:
            import fsspec

            system, path = fsspec.core.url_to_fs(self.url)
        except ImportError as error:
            raise ResultError(f"{self.name} needs a package that is not installed: {said(error)}") from None
        except Exception as error:  # of the reader of the URL  # noqa: BLE001
            raise self._lost(error) from None
        return system, path.rstrip("/")

    def _lost(self, error: Exception) -> ResultError:
        return ResultError(f"{self.name} cannot be reached: {said(error)}")


def local_place(path: str | os.PathLike[str]) -> Path | None:
    """Return the path of a store in the file system, also where a URL ``file://`` names it; None: another URL."""
    scheme, slashes, rest = str(path).partition("://")
    if not slashes:
        return Path(path)
    return Path(url2pathname(rest)) if scheme.lower() in ("file", "local") else None


def said(error: Exception) -> str:
    """Return the words of an error, in one short line."""
    return reason(error) if isinstance(error, OSError) else shorten(str(error) or type(error).__name__, 200)
