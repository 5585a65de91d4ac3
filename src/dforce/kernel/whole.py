"""Whole-program compilation: link all callees into each entry point, and generate code once.

numba links, optimizes and translates every function by itself, then links it into its callers and does the same again. Most of
its time goes into code that is never called by itself. Here a function with callers stays intermediate code in memory. It
is linked, optimized and translated to machine code in the functions that are called from outside, and where its address is
needed. Only such wholes are kept on disk: the code of each follows from its text, independent of earlier compilations.
"""

from __future__ import annotations

import contextlib
import functools
import threading
from collections.abc import Iterator
from typing import Any

from dforce.core.stopping import look

# the members used of numba's class for a function's code; a numba without them compiles in its own way
USED = (
    "_check_llvm_bugs",
    "_ensure_finalized",
    "_finalize_final_module",
    "_get_module_for_linking",
    "_optimize_final_module",
    "add_linking_library",
    "codegen",
    "finalize",
    "get_pointer_to_function",
)
_COUNTING = threading.Lock()
_INSIDE: list[Any] = []  # the class that each compilation has found


@functools.cache
def way() -> str:
    """Return the name of the way in which functions are compiled: it decides the last digits of their results."""
    from numba.core.codegen import JITCodeLibrary, JITCPUCodegen

    known = all(hasattr(JITCodeLibrary, name) or hasattr(JITCPUCodegen, name) for name in USED)
    return "as closed wholes" if known and hasattr(JITCPUCodegen, "_library_class") else "in parts"


@contextlib.contextmanager
def compiled() -> Iterator[None]:
    """Compile as wholes inside the context, in all threads."""
    from numba.core.registry import cpu_target

    if way() == "in parts":
        yield
        return
    codegen: Any = cpu_target.target_context.codegen()
    with _COUNTING:
        _INSIDE.append(codegen._library_class)
        codegen._library_class = _library()
    try:
        yield
    finally:
        with _COUNTING:
            found = _INSIDE.pop()
            codegen._library_class = _library() if _INSIDE else found


def is_part(library: Any) -> bool:
    """Return whether a function's code is left for its callers to compile."""
    return way() != "in parts" and isinstance(library, _library()) and not library._finalized


class _Unneeded:
    """numba's maker of code for a function without code of its own, which has no place for the function's constants."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing."""


@functools.cache
def _library() -> Any:
    """Return the class for the code of one function; numba is loaded for it."""
    from llvmlite.binding import Linkage
    from numba.core.codegen import JITCodeLibrary
    from numba.core.environment import lookup_environment

    class Whole(JITCodeLibrary):
        _codegen: Any
        _as_written: Any = None  # as others can link it

        @property
        def codegen(self) -> Any:
            return self._codegen if self._finalized else _Unneeded(self._codegen)

        def add_linking_library(self, library: Any) -> None:
            if not is_part(library):
                library._ensure_finalized()
            self._linking_libraries.append(library)

        def as_written(self) -> Any:
            """Return a copy of the function that others can link, without its callees."""
            if self._as_written is None:
                self._as_written = self._final_module.clone()
                for function in self._as_written.functions:
                    if not function.is_declaration and function.linkage == Linkage.external:
                        function.linkage = "linkonce_odr"
            return self._as_written

        def called(self) -> list[Any]:
            """Return all direct and indirect callees, each before its own callees."""
            found: dict[Any, None] = {}

            def visit(library: Any) -> None:
                for other in library._linking_libraries:
                    if other not in found:
                        if is_part(other):
                            visit(other)
                        found[other] = None

            visit(self)
            return list(found)[::-1]

        def _link(self) -> None:
            for library in self.called():  # in this order: a function that is not called yet is left out
                if hasattr(self, "_reload_init"):  # younger versions of numba only
                    self._reload_init.update(library._reload_init)
                module = library.as_written() if is_part(library) else library._get_module_for_linking()
                self._final_module.link_in(module, preserve=True)
            # these have no other callers: functions called once are inlined, and unused results are not returned
            for function in self._final_module.functions:
                if function.linkage == Linkage.linkonce_odr:
                    function.linkage = "internal"

        def finalize(self) -> None:
            look()  # nothing of this function is done yet
            self._codegen._check_llvm_bugs()
            self._raise_if_finalized()
            part = self._final_module
            self._final_module = part.clone()
            try:
                self._link()
                self._optimize_final_module()
                self._final_module.verify()
                self._finalize_final_module()
            except BaseException:  # Ctrl-C, too: the next who wants it begins anew
                self._final_module = part
                raise
            for variable in self._final_module.global_variables:
                environment = lookup_environment(variable.name) if variable.name.startswith("_ZN08NumbaEnv") else None
                if environment is not None:
                    self._codegen.set_env(variable.name, environment)

        def get_pointer_to_function(self, name: str) -> int:
            if is_part(self) and name not in {f.name for f in self._final_module.functions if not f.is_declaration}:
                return 0
            return int(super().get_pointer_to_function(name))

    return Whole
