"""Keeps composed modules on disk, so that a second process starts without compiling.

The folder is the user's cache folder, or ``DFORCE_CACHE_DIR``. Each module has a folder there, named by the hash of its text
and of the versions that compile it. It contains the text, for a reader, and the compiled code
(:mod:`dforce.kernel.cache_files`). Damaged files are made again. A folder into which others may have written is not used
(:mod:`dforce.core.places`): a folder of this process alone replaces it. Code in a folder that is not writable is used.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.metadata
import os
import platform
import re
import shutil
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from dforce.core import log
from dforce.core.errors import ParameterError, shorten
from dforce.core.files import reason
from dforce.core.garbage import seldom_collected
from dforce.core.places import not_own, user_folder
from dforce.core.stopping import look, unbroken
from dforce.kernel import whole
from dforce.kernel.cache_files import KeptCode, kept

LONGEST = 120.0  # s that a process waits for another one's compilation
LOOK = 0.05  # s that it does so without a look whether it is to stop
TEXTS = "texts"  # folder beside the kernels, see ``kernel.texts``
MOST_KERNELS = 250  # folders kept; the least recently used go first
NAME = re.compile(r"[0-9a-f]{20}")
# numba's settings, from variables such as NUMBA_OPT, that change the compiled code
SETTINGS = ("OPT", "BOUNDSCHECK", "DEBUGINFO_DEFAULT", "LOOP_VECTORIZE", "SLP_VECTORIZE")
_COMPILING = threading.RLock()  # the settings during a compilation affect the whole process
_MAKING = threading.Lock()  # this process makes only one folder of its own
_IMPORTING = threading.Lock()  # a module that another thread is importing is not whole yet


@dataclass(frozen=True)
class KernelCache:
    """The folder of compiled force models, their number, their size (bytes), and how often this process could keep none."""

    folder: Path
    kernels: int
    size: int
    lost: int = field(default=0, compare=False)


def cache_folder(inner: str = "") -> Path:
    """Return the folder where kernels are kept; it may not exist, or not be writable.

    Where others may have written into it, or into its folder `inner`, it is a folder of this process alone.

    Raises
    ------
    ParameterError
        When no folder is set, and the user has none.
    """
    folder = _asked_folder()
    for place in (folder, folder / inner):
        if why := not_own(place):
            _say_not_used(place, why)
            with _MAKING:
                return Path(_of_this_process().name)
    return folder


def _asked_folder() -> Path:
    """Return the folder where the user wants kernels to be.

    Raises
    ------
    ParameterError
        When no folder is set, and the user has none.
    """
    given = os.environ.get("DFORCE_CACHE_DIR")
    return Path(given) if given else user_folder("cache") / "kernels"


def kernel_cache() -> KernelCache:
    """Return the folder of compiled force models, their number and their size (bytes)."""
    folders = _kernels(_asked_folder())
    return KernelCache(_asked_folder(), len(folders), sum(map(_size, folders)), complaints())


def clear_kernel_cache() -> KernelCache:
    """Remove all compiled force models from the disk, and return their number and size (bytes); a later run compiles again."""
    before = kernel_cache()
    for folder in (*_kernels(before.folder), before.folder / TEXTS):
        shutil.rmtree(folder, ignore_errors=True)
    after = kernel_cache()
    return KernelCache(before.folder, before.kernels - after.kernels, before.size - after.size)


def _kernels(base: Path) -> list[Path]:
    """Return the folders of this module's making: the user may have named a folder that holds other things."""
    try:
        found = [folder for folder in base.iterdir() if NAME.fullmatch(folder.name)]
        return [folder for folder in found if any(folder.glob(f"kernel_{folder.name}.*"))]
    except OSError:
        return []


def _size(folder: Path) -> int:
    size = 0
    for path in folder.rglob("*"):
        with contextlib.suppress(OSError):  # gone in this moment
            size += path.stat().st_size if path.is_file() else 0
    return size


def check_compiler() -> None:
    """Load numba.

    Raises
    ------
    ParameterError
        When the environment does not let it compile.
    """
    try:
        with warnings.catch_warnings():
            # a setting that it cannot read is left out with a warning, and half a page of where that was
            warnings.filterwarnings("error", "\\s*Environment variable", RuntimeWarning)
            import numba
            import numba.np.ufunc.parallel
    except Exception as error:  # its settings are read when it is loaded, and it has its own wishes for NumPy
        words = shorten(" ".join(str(error).partition("The parse failed")[0].split()), 200).rstrip(".")
        given = sorted(name for name in os.environ if name.startswith("NUMBA_"))
        hint = f"; check the environment variable{'s' * (len(given) > 1)} {', '.join(given)}" if given else ""
        raise ParameterError(f"numba, the compiler of dForce, cannot be loaded: {words}{hint}") from error
    settings: Any = numba.config
    if settings.DISABLE_JIT:
        raise ParameterError(
            "the environment variable NUMBA_DISABLE_JIT turns off numba, the compiler of dForce; unset it"
        )


def fingerprint(text: str) -> str:
    """Return the hash of a module's text and of everything else that decides its compiled code."""
    import numba

    versions = [importlib.metadata.version(name) for name in ("numba", "llvmlite", "numpy")]
    machine = [platform.python_implementation(), *map(str, sys.version_info[:3]), platform.machine(), sys.platform]
    settings = [repr(getattr(numba.config, name, None)) for name in SETTINGS]
    return hashlib.sha256("\0".join([text, *versions, *machine, *settings, whole.way()]).encode()).hexdigest()[:20]


def place(text: str) -> Path:
    """Return the file for a module's text, written if need be and possible; two processes may do this at once."""
    name = fingerprint(text)
    base = cache_folder(name)
    path = base / name / f"kernel_{name}.py"
    try:
        with contextlib.suppress(OSError):
            os.utime(path.parent)  # marks the kernel as used
        if not path.is_file() or path.read_bytes() != text.encode():
            make_folder(path.parent)
            path.write_bytes(text.encode())
            for folder in oldest(_kernels(base), MOST_KERNELS):
                shutil.rmtree(folder, ignore_errors=True)
    except OSError as error:
        _say_not_kept(base, reason(error))
    return path


def make_folder(folder: Path) -> None:
    """Make a folder of the cache, which nobody else may write to.

    Raises
    ------
    OSError
        When it cannot be made.
    """
    folder.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)


@functools.cache
def _of_this_process() -> tempfile.TemporaryDirectory[str]:
    """Return a folder that goes when this process ends."""
    return tempfile.TemporaryDirectory(prefix="dforce-", ignore_cleanup_errors=True)


@functools.lru_cache(maxsize=16)  # said once
def _say_not_used(folder: Path, why: str) -> None:
    name = shorten(str(folder), 200)
    remedy = f"type chmod -R go-w '{name}'" if "write" in why else "set DFORCE_CACHE_DIR to a folder of your own"
    log.announce(f"Compiled code in '{name}' is not used, because {why}, so each start compiles it again; {remedy}.")


def oldest(paths: Sequence[Path], most: int) -> list[Path]:
    """Return the files or folders written first, where there are too many."""
    with contextlib.suppress(OSError):  # another process may remove some of them
        return sorted(paths, key=lambda path: path.stat().st_mtime)[: max(0, len(paths) - most)]
    return []


def load(text: str) -> ModuleType:
    """Return the module with this text; its functions compile, or come from disk, when first called.

    Raises
    ------
    ParameterError
        When the environment does not let numba compile.
    """
    check_compiler()
    from numba.core.dispatcher import Dispatcher

    with _IMPORTING:
        name = f"kernel_{fingerprint(text)}"
        if name in sys.modules:
            return sys.modules[name]
        path = place(text)
        module = ModuleType(name)
        module.__file__ = str(path)
        sys.modules[name] = module
        try:
            exec(compile(text, str(path), "exec"), vars(module))
        except BaseException:
            del sys.modules[name]
            raise
        dispatchers: dict[str, Any] = {name: f for name, f in vars(module).items() if isinstance(f, Dispatcher)}
        for function, dispatcher in dispatchers.items():
            dispatcher._cache = KeptCode(function, path.parent, lambda error: _not_kept(path.parent, error))
        return module


def _not_kept(folder: Path, error: OSError) -> None:
    """Announce why code is not kept in a folder; a missing folder was announced by :func:`place`, or a user removed it."""
    if folder.is_dir():
        _say_not_kept(folder.parent, reason(error))


@functools.lru_cache(maxsize=16)  # said once
def _say_not_kept(folder: Path, why: str) -> None:
    log.announce(
        f"Compiled code cannot be kept in '{shorten(str(folder))}' ({why}), so each start compiles it again; "
        "set DFORCE_CACHE_DIR to a folder that you can write to."
    )


def complaints() -> int:
    """Return the number of folders for which this process has announced that it keeps no compiled code there."""
    return _say_not_kept.cache_info().currsize + _say_not_used.cache_info().currsize


@contextlib.contextmanager
def one_at_a_time(module: ModuleType, function: str) -> Iterator[None]:
    """Keep other processes from compiling the same function of a module at the same time; they wait, and find it on disk."""
    import filelock

    lock = filelock.FileLock(Path(str(module.__file__)).with_suffix(f".{function}.lock"), timeout=LOOK)
    with alone():
        end = time.monotonic() + LONGEST
        with contextlib.suppress(OSError, NotImplementedError):  # no locks on this disk
            while not lock.is_locked and time.monotonic() < end:  # longer would lead to nothing
                look()
                with contextlib.suppress(filelock.Timeout):
                    lock.acquire()
        try:
            with unbroken(), seldom_collected():
                yield
        finally:
            lock.release()


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Keep other threads from compiling, or loading from disk, at the same time: numba's code is in order for one alone."""
    with _COMPILING:
        look()  # who waited may have been stopped meanwhile
        with whole.compiled():
            yield


def is_compiled(module: ModuleType, function: str) -> bool:
    """Return whether compiled code of a module's entry function is in memory, or undamaged on disk."""
    dispatcher = getattr(module, function)
    return bool(dispatcher.signatures) or any(kept(path) is not None for path in dispatcher._cache.files())
