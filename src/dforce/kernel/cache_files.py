"""Keeps the compiled code of a module's functions on disk, a file for each signature and processor.

numba does not check its own files: a truncated file or a flipped bit would end the process or, worse, give other numbers.
Here each file begins with the hash of its content: a damaged file is removed, and its function compiled again.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import secrets
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from dforce.core.files import put_in_place
from dforce.core.places import not_own_by
from dforce.kernel.whole import is_part

CODE = ".code"
HASH = hashlib.sha256


def keep(path: Path, content: bytes) -> None:
    """Write a file with its hash, in one step.

    Raises
    ------
    OSError
        When it cannot be written.
    """
    temporary = path.with_name(f"{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))  # nobody else may write to it, ever
        temporary.write_bytes(HASH(content).digest() + content)
        put_in_place(temporary, path)
    except OSError:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise


def kept(path: Path) -> bytes | None:
    """Return the content of a file; None where it is missing or damaged, or others may have written it.

    A damaged file is removed.
    """
    try:
        with path.open("rb") as stream:
            if not_own_by(os.fstat(stream.fileno())):
                return None
            found = stream.read()
    except OSError:
        return None
    size = HASH().digest_size
    if HASH(found[size:]).digest() == found[:size]:
        return found[size:]
    forget(path)
    return None


def forget(path: Path) -> None:
    """Remove a file where that may be done; where not, it is passed over at each start."""
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)


class KeptCode:
    """The compiled code of one function, in the place of numba's own cache, whose methods it has.

    Parameters
    ----------
    function
        Name of the function.
    folder
        Where its code lies.
    failed
        Called with the error when code cannot be written.
    """

    def __init__(self, function: str, folder: Path, failed: Callable[[OSError], None]) -> None:
        self._function, self._folder, self._failed = function, folder, failed

    @property
    def cache_path(self) -> str:
        """The folder."""
        return str(self._folder)

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return numba's result of compiling for these types, None where none is kept that can be used."""
        from numba.core.compiler import CompileResult
        from numba.core.runtime.nrt import rtsys

        rtsys.initialize(target)  # enough for compiled code; `target.refresh` would also load the compiler
        path = self._path(signature, target.codegen())
        content = kept(path)
        if content is None:
            return None
        try:
            types, parts = pickle.loads(content)
            return CompileResult._rebuild(target, *parts) if types == str(signature) else None
        except Exception:  # the file is damaged: the function is compiled anew  # noqa: BLE001
            forget(path)
            return None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep numba's result of compiling for these types, if it is code by itself and holds no address of this process."""
        from numba.core.serialize import dumps

        library = compiled.library
        if is_part(library) or library.has_dynamic_globals:
            return
        try:
            keep(self._path(signature, compiled.codegen), dumps((str(signature), compiled._reduce())))
        except OSError as error:
            self._failed(error)

    def files(self) -> Iterator[Path]:
        """Give the files with code for this processor, for any types."""
        from numba.core.registry import cpu_target

        return self._folder.glob(f"{self._start(cpu_target.target_context.codegen())}-*{CODE}")

    def _start(self, codegen: Any) -> str:
        return f"{self._function}-{_short(repr(codegen.magic_tuple()))}"

    def _path(self, signature: Any, codegen: Any) -> Path:
        return self._folder / f"{self._start(codegen)}-{_short(str(signature))}{CODE}"


def _short(text: str) -> str:
    return HASH(text.encode()).hexdigest()[:12]
