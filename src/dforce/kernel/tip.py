"""The tip equation as compiled solvers take it: numbers, and the addresses of the functions that they call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.kernel import Kernel, any_force, load, load_any, load_laws, size_of
from dforce.kernel.codegen import OTHERS, native_types
from dforce.problem import Problem


class TipFunctions:
    """The tip equation as the solvers take it: its parameters, and where the compiled functions lie that they call.

    Parameters
    ----------
    kernel
        Holds the functions that are compiled for this combination of forces.
    called
        All functions that the solvers call, in the order of their addresses.
    lanes
        Which of them march lanes, and are compiled for the number of tones, too.
    shared
        Which of them are the same for any forces, whose laws they call by address.
    """

    def __init__(
        self,
        kernel: Kernel,
        problem: Problem,
        called: dict[str, Callable[..., Any]],
        lanes: dict[str, Callable[..., Any]],
        shared: dict[str, Callable[..., Any]],
    ) -> None:
        self._kernel, self._problem, self._called, self._lanes, self._shared = kernel, problem, called, lanes, shared
        size = size_of(problem)
        self._types = {name: native_types(function, size, len(called)) for name, function in called.items()}
        self._addresses = dict.fromkeys(called, 0)
        # numbers behind all parameters: addresses of laws, whether one begins like a root, and where branches begin
        self._laws = np.zeros(len(any_force.WITH_STATES) + 2)

    def at(self, p: tuple[float, ...], names: Sequence[str]) -> tuple[Any, ...]:
        """Return it for one parameter tuple, with these functions compiled."""
        for name in names:
            if not self._addresses[name]:
                self._addresses[name] = self._home(name).address(name, self._types[name])
                if name in self._shared and not self._laws[0]:
                    self._find_laws()
        return (*p[:OTHERS], np.array([*p[OTHERS:], *self._laws]), *self._addresses.values())

    def _home(self, name: str) -> Kernel:
        """Return the kernel that holds a function."""
        if name in self._shared:
            return load_any(self._problem, self._shared)
        if name in self._lanes:
            return load(self._problem, self._lanes, tuple(self._called.values()), lanes=True)
        return self._kernel

    def numbers(self, table: Array) -> Array:
        """Return parameters (problems, parameters) as the solvers take them, (parameters + 5, problems), after :meth:`at`."""
        return np.ascontiguousarray(np.vstack([table.T, np.repeat(self._laws[:, None], len(table), axis=1)]))

    def _find_laws(self) -> None:
        forces = self._problem.forces
        laws, self._laws[-2] = load_laws(forces), any(force.is_rooted for force in forces)
        self._laws[-1] = size_of(self._problem) + sum(force.memory for force in forces)
        for place, (name, (_, types)) in enumerate(any_force.functions_of(forces).items()):
            self._laws[place] = laws.address(f"{name}_at", types)  # whole numbers below 2**53 are exact
