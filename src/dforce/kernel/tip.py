"""The tip equation as compiled solvers take it: numbers, and the addresses of the functions that they call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.core.first_answer import may_be_early
from dforce.kernel import Kernel, any_force, behind, load_any, load_laws, size_of
from dforce.kernel.codegen import OTHERS, native_types
from dforce.problem import Problem


class TipFunctions:
    """The tip equation as the solvers take it: its parameters, and where the compiled functions lie that they call.

    Where answers may be early (:mod:`dforce.core.first_answer`), functions that are not compiled yet are compiled in the
    background, and those for any force called meanwhile. Where these are not compiled either, that is done in the background.
    """

    def __init__(self, kernel: Kernel, problem: Problem, called: dict[str, Callable[..., Any]]) -> None:
        self._kernel, self._problem, self._called = kernel, problem, called
        size = size_of(problem)
        self._types = {name: native_types(function, size, len(called)) for name, function in called.items()}
        self._addresses = dict.fromkeys(called, 0)
        self._is_own = dict.fromkeys(called, False)
        self._laws = np.zeros(len(any_force.WITH_STATES))  # their addresses, numbers behind all parameters

    def at(self, p: tuple[float, ...], names: Sequence[str]) -> tuple[Any, ...]:
        """Return it for one parameter tuple, with these functions compiled."""
        wanted = [name for name in names if not self._is_own[name]]
        missing = [name for name in wanted if not self._kernel.is_ready(name)]
        if missing and not self._stands_in(missing):
            missing = []
        for name in wanted:
            if name not in missing:
                self._addresses[name], self._is_own[name] = self._kernel.address(name, self._types[name]), True
        return self.unready(p)

    def unready(self, p: tuple[float, ...]) -> tuple[Any, ...]:
        """Return it for one parameter tuple, with 0 in the place of what is not compiled."""
        return (*p[:OTHERS], np.array([*p[OTHERS:], *self._laws]), *self._addresses.values())

    def numbers(self, table: Array) -> Array:
        """Return parameters (problems, parameters) as the solvers take them, (parameters + 3, problems), after :meth:`at`."""
        return np.ascontiguousarray(np.vstack([table.T, np.repeat(self._laws[:, None], len(table), axis=1)]))

    def code(self, name: str) -> tuple[Path, dict[str, str]]:
        """Return the file that holds a function's text, and the function with its types, for another process to compile."""
        return self._kernel.file, {name: self._types[name]}

    def prepare(self, names: Sequence[str]) -> None:
        """Compile these functions for any force, so that the first answer of the next combination can be early."""
        for name in names:
            load_any(self._problem, self._called).address(name, self._types[name])

    def _stands_in(self, missing: list[str]) -> bool:
        """Return whether functions for any force are called in the place of these."""
        if not may_be_early():
            return False
        instead, functions = load_any(self._problem, self._called), {name: self._types[name] for name in missing}
        if not all(map(instead.is_ready, missing)):
            behind.begin(instead.file, functions)
            return False
        what = (
            f"Compiling {self._kernel.what} in the background; until then, slower general code gives the same result."
        )
        if not behind.begin(self._kernel.file, functions, what):
            return False
        for name, types in functions.items():
            self._addresses[name] = instead.address(name, types)
        laws = load_laws(self._problem.forces)
        for place, (name, (_, types)) in enumerate(any_force.functions_of(self._problem.forces).items()):
            self._laws[place] = laws.address(f"{name}_at", types)  # whole numbers below 2**53 are exact
        return True
