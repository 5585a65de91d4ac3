"""Keeps composed modules on disk, so that a second process starts without compiling.

The folder is the user's cache folder, or ``DFORCE_CACHE_DIR``. Each module lies in a folder named by the hash of its text
and of the versions that compile it; numba keeps its compiled code beside it. Where nothing can be written, modules live
in a temporary folder for the length of the process.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import gc
import hashlib
import importlib.metadata
import importlib.util
import os
import platform
import shutil
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

STAMP = 1_500_000_000  # numba trusts its code while the source's time is unchanged: so every writer gives the same time
LONGEST = 120.0  # s that a process waits for another one's compilation
MOST_KERNELS = 100  # folders kept, of some 5 MB each; the least recently used go first
SELDOM = 100_000  # new objects between two looks for garbage while a kernel is compiled
_COMPILING = threading.RLock()  # what is done meanwhile concerns the whole process
_IMPORTING = threading.Lock()  # a module that another thread is importing is not whole yet


def cache_folder() -> Path:
    """Return the folder where kernels are kept; it may not exist, or not be writable."""
    given = os.environ.get("DFORCE_CACHE_DIR")
    if given:
        return Path(given)
    import platformdirs

    return Path(platformdirs.user_cache_dir("dforce", appauthor=False)) / "kernels"


@functools.cache
def _temporary_folder() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="dforce-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def fingerprint(text: str) -> str:
    """Return the hash of a module's text and of everything else that decides what it compiles to."""
    versions = [importlib.metadata.version(name) for name in ("numba", "llvmlite", "numpy")]
    machine = [platform.python_implementation(), *map(str, sys.version_info[:3]), platform.machine(), sys.platform]
    return hashlib.sha256("\0".join([text, *versions, *machine]).encode()).hexdigest()[:20]


def place(text: str) -> Path:
    """Return a file that holds the text, written if need be; two processes may do this at once."""
    name = fingerprint(text)
    for base in (cache_folder(), _temporary_folder()):
        path = base / name / f"kernel_{name}.py"
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
            if path.is_file() and path.read_text(encoding="utf-8") == text:  # else cut short by a crash
                Path(temporary).unlink()
                os.utime(path.parent)  # marks the kernel as used
                return path
            os.utime(temporary, (STAMP, STAMP))
            Path(temporary).replace(path)
        except OSError:
            continue  # numba too can only use a folder that can be written
        with contextlib.suppress(OSError):  # another process may forget the same ones
            _forget_oldest(base)
        return path
    raise OSError("neither the cache folder nor a temporary folder can be written")


def _forget_oldest(base: Path) -> None:
    # only folders of this module's making: the user may have named a folder that holds other things
    folders = [file.parent for file in base.glob("*/kernel_*.py") if file.stem == f"kernel_{file.parent.name}"]
    if len(folders) <= MOST_KERNELS:
        return
    by_age = sorted(folders, key=lambda folder: folder.stat().st_mtime)
    for folder in by_age[: len(folders) - MOST_KERNELS]:
        shutil.rmtree(folder, ignore_errors=True)


def load(text: str) -> ModuleType:
    """Import the module with this text; functions compile, or come from disk, when first called."""
    path = place(text)
    name = path.stem
    with _IMPORTING:
        if name in sys.modules:
            return sys.modules[name]
        spec = importlib.util.spec_from_file_location(name, path)
        if spec is None or spec.loader is None:
            raise ImportError(f"cannot import {path.name}")
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise
        return module


@contextlib.contextmanager
def one_at_a_time(module: ModuleType) -> Iterator[None]:
    """Keep other processes from compiling the same module at the same time; they wait, and find it on disk."""
    import filelock

    lock = filelock.FileLock(Path(str(module.__file__)).with_suffix(".lock"), timeout=LONGEST)
    with _COMPILING, _seldom_collected():
        with contextlib.suppress(OSError, NotImplementedError):  # no locks on this disk, or nothing came of the waiting
            lock.acquire()
        try:
            yield
        finally:
            lock.release()


@contextlib.contextmanager
def _seldom_collected() -> Iterator[None]:
    """Look for garbage less often: the compiler makes so many objects to stay that this takes a tenth of its time."""
    before = gc.get_threshold()
    gc.set_threshold(max(SELDOM, before[0]) if before[0] else 0, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


def is_compiled(module: ModuleType, function: str) -> bool:
    """Say whether compiled code of a module's entry function lies on disk or in memory."""
    if getattr(module, function).signatures:
        return True
    folder = Path(str(module.__file__)).parent / "__pycache__"
    return any(folder.glob(f"{module.__name__}.{function}-*.nbi"))
