"""How far a compilation is, for who waits for it: code that is compiled, as a share of the code that is to be compiled."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from types import ModuleType
from typing import Any, Protocol

from dforce.core import log

# The time that a function takes by itself, and once more in each entry function that it is linked into, as shares.
WRITTEN, LINKED = 0.6, 0.25
_COMPILED: dict[str, float] = {}  # the effort so far in this process, by the name of the kernels


class Part(Protocol):
    """A kernel, as a part of all kernels with its name; see ``kernel.Kernel``."""

    module: ModuleType
    title: str
    usual: Sequence[str]

    def is_ready(self, name: str) -> bool:
        """Return whether compiled code of an entry function exists."""


@contextlib.contextmanager
def watched(kernel: Part, entry: str, known: Iterable[Part]) -> Iterator[None]:
    """Show the progress of the compilation while an entry function is compiled inside.

    It is the progress of all known kernels with the same name, with their usual entry functions.
    """
    alike = [part for part in {kernel, *known} if part.title == kernel.title]
    parts = {part: {name for name in part.usual if not part.is_ready(name)} for part in alike}
    parts[kernel].add(entry)
    before = _COMPILED.get(kernel.title, 0.0)
    whole = before + sum(effort(part.module, missing) for part, missing in parts.items())

    def tell(done: float) -> None:
        _COMPILED[kernel.title] = before + done
        log.show_progress(f"Compiling {kernel.title}, once", (before + done) / whole)

    with counted(kernel.module, entry, tell):
        yield


def sizes(module: ModuleType, entry: str) -> dict[str, int]:
    """Return the bytes of Python's code of an entry function and of all that it calls, by name."""
    found: dict[str, int] = {}
    left = [entry]
    while left:
        name = left.pop()
        function = getattr(module, name, None)
        code = getattr(getattr(function, "py_func", function), "__code__", None)
        if name not in found and code is not None:
            found[name] = len(code.co_code)
            left += code.co_names
    return found


def effort(module: ModuleType, entries: Iterable[str]) -> float:
    """Return the effort for entry functions, in bytes of code: each function once, and once more where it is linked.

    A function that has been compiled already is only linked.
    """
    of_entries = [sizes(module, entry) for entry in entries]
    new = {name: size for one in of_entries for name, size in one.items() if not _is_compiled(module, name)}
    return WRITTEN * sum(new.values()) + LINKED * sum(sum(one.values()) for one in of_entries)


def _is_compiled(module: ModuleType, name: str) -> bool:
    return bool(getattr(getattr(module, name), "signatures", ()))


@contextlib.contextmanager
def counted(module: ModuleType, entry: str, tell: Callable[[float], None]) -> Iterator[None]:
    """Call a function with the effort so far, each time that a function of a module has been compiled inside."""
    from numba.core import event

    left = sizes(module, entry)
    linked, done = LINKED * sum(left.values()), 0.0

    class Counter(event.Listener):
        def on_start(self, _event: Any) -> None:
            """Wait for its end."""

        def on_end(self, ended: Any) -> None:
            nonlocal done
            done += WRITTEN * left.pop(ended.data["dispatcher"].py_func.__name__, 0)
            tell(done)

    with event.install_listener("numba:compile", Counter()):
        yield
    tell(done + linked)
