"""Background compilation of functions of a kernel, in a subprocess.

It knows the kernel by the file of its text alone, belongs to no terminal, and gives way to all others; of several one works at
a time. It may be ended at any time: code is written to disk whole or not at all. It outlives who started it only where that
ends by itself, and says so through a pipe; a stop and a kill, which close the pipe without a word, end both.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path

from dforce.core import child, log
from dforce.core.stopping import was_stopped
from dforce.kernel import cache

LONGEST = 3.0 * cache.LONGEST  # s that it may work: it waits for those who compile the same
NICE = 10
BELOW = getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)  # the same on Windows
AUTOGROUP = Path("/proc/self/autogroup")
RUN = "from dforce.kernel.behind import main; main()"
GO_ON = b"."  # what is told to a process that is to outlive this one
LOCK = "background.lock"  # file beside the kernels
_BEGINNING = threading.Lock()
_BEGUN: set[tuple[Path, str]] = set()  # files and functions, of this process


def begin(file: Path, functions: Mapping[str, str], words: str = "") -> bool:
    """Compile functions, given with their types, of the kernel whose text a file holds; return whether that could be begun.

    What has been begun is not begun again. `words` are announced where it was not.
    """
    if not file.is_file() or not can_keep(file.parent):
        return False
    with _BEGINNING:
        new = [name for name in functions if (file, name) not in _BEGUN]
        if not new:
            return True
        try:
            asked = [part for name in new for part in (name, functions[name])]
            start(RUN, [str(file.resolve()), *asked], file.parent, BELOW)
        except OSError:  # no more processes, or none at all
            return False
        _BEGUN.update((file, name) for name in new)
    if words:
        log.announce(words)
    return True


def can_keep(folder: Path) -> bool:
    """Say whether a process that is started here could keep what it compiles in a folder."""
    return child.can_start() and os.access(folder, os.W_OK)


def start(code: str, arguments: Sequence[str], folder: Path, priority: int = 0) -> subprocess.Popen[bytes]:
    """Start Python with code and arguments in a folder, apart from any terminal, and wait for its end in a thread.

    `priority` is a flag of Windows alone.

    Raises
    ------
    OSError
        When there is no more room for a process.
    """
    environment = child.environment() | {"DFORCE_CACHE_DIR": str(cache.cache_folder().resolve())}
    process = subprocess.Popen(
        child.command("-c", code, *arguments),
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        cwd=folder,
        env=environment,
        start_new_session=True,
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0) | priority,
    )
    atexit.register(_let_go_on, process)
    with contextlib.suppress(RuntimeError):  # no more threads
        # nobody else waits: one that ends leaves the system's list, and one that goes on is warned of by nobody
        threading.Thread(target=process.wait, daemon=True).start()
    return process


def _let_go_on(process: subprocess.Popen[bytes]) -> None:
    """Let a process outlive this one, which ends by itself; not after a stop."""
    if process.stdin is not None:
        with contextlib.suppress(OSError):  # it has ended
            process.stdin.write(b"" if was_stopped() else GO_ON)
            process.stdin.close()


def main() -> None:
    """Compile what the command line names: the file of the text, then functions, each with its types."""
    import filelock

    end_in_time()
    give_way()
    _, file, *rest = sys.argv
    with filelock.FileLock(cache.cache_folder() / LOCK):
        compile_all(Path(file), dict(zip(rest[::2], rest[1::2], strict=True)))


def end_in_time() -> None:
    """Let this process end once it has waited and worked for long enough, or with who started it."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    end = threading.Timer(LONGEST, os._exit, (1,))
    end.daemon = True
    end.start()


def _end_with_parent() -> None:
    """End when the pipe from who started this is closed without a word."""
    if not os.read(
        0, len(GO_ON)
    ):  # the standard input; Python's own object for it may not be in use when this process ends
        os._exit(1)


def give_way() -> None:
    """Let all other processes of this machine go first."""
    if hasattr(os, "nice"):
        os.nice(NICE)
    with contextlib.suppress(OSError):  # Linux, to which a process without a terminal is a group of its own
        AUTOGROUP.write_text(str(NICE), encoding="ascii")


def compile_all(file: Path, functions: Mapping[str, str]) -> None:
    """Compile functions, given with their types, of the kernel whose text a file holds, and keep them on disk."""
    from dforce.kernel import Kernel

    text = file.read_text(encoding="utf-8")
    if cache.place(text) != file:
        return  # another version of Python or numba, whose code nobody waits for
    kernel = Kernel(cache.load(text), "the functions of a kernel")
    for name, types in functions.items():
        kernel.address(name, types)
