"""The compiled functions of the solvers: which there are, and where they lie for the forces of a problem."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from dforce import kernel
from dforce.core.arrays import Array
from dforce.integrators import lanes, loops, lsoda, rk4
from dforce.kernel import Kernel, any_force
from dforce.kernel.codegen import OTHERS, native_types
from dforce.observables import lockin, measure
from dforce.problem import Problem
from dforce.solvers import newton, period_map, quasi_static, relaxation

Functions = dict[str, Callable[..., Any]]
# called by address: compiled for each combination of forces, of forces and tones, and once for all
OWN: Functions = {"advance": rk4.advance}
LANES: Functions = {"advance_lanes": lanes.advance_lanes}
SHARED: Functions = {"cut": rk4.cut, "cut_lanes": lanes.cut_lanes, "measure_force": measure.measure_force}
CALLED = OWN | LANES | SHARED
# compiled once for all forces
SOLVERS: Functions = {
    "march_rk4": rk4.march,
    "measure": measure.measure,
    "follow": quasi_static.follow,
    "advance_block": period_map.advance_block,
    "march": period_map.march,
    "find_orbits": newton.find_orbits,
    "take_steps": newton.take_steps,
    "take_leaps": relaxation.take_leaps,
}
USUAL = ("follow", "march", "take_leaps")  # the entries that a curve compiles
ENTRIES: Functions = OWN | {
    "derivative": lsoda.derivative,
    "sample": lsoda.sample,
    "lock_in": lockin.lock_in,
    "phases": loops.phases,
}


def load_kernels(problem: Problem) -> tuple[Kernel, Kernel]:
    """Return the composed tip equation of a problem, and the solvers that call it."""
    called = tuple(CALLED.values())
    own = kernel.load(problem, ENTRIES, called)
    return own, kernel.load_solvers(len(problem.modes), SOLVERS, called, problem.late_fluid, USUAL)


class TipFunctions:
    """The tip equation of a problem as the solvers take it: its parameters, and the addresses of the functions that they call.

    `own` is its composed tip equation.
    """

    def __init__(self, own: Kernel, problem: Problem) -> None:
        self._own, self._problem = own, problem
        size = kernel.size_of(problem)
        self._types = {name: native_types(function, size, len(CALLED)) for name, function in CALLED.items()}
        self._addresses = dict.fromkeys(CALLED, 0)
        # numbers behind all parameters: addresses of laws, whether one begins like a root, and where branches begin
        self._laws = np.zeros(len(any_force.WITH_STATES) + 2)

    def at(self, p: tuple[float, ...], names: Sequence[str]) -> tuple[Any, ...]:
        """Return it for one parameter tuple, with these functions compiled."""
        for name in names:
            if not self._addresses[name]:
                self._addresses[name] = self._home(name).address(name, self._types[name])
                if name in SHARED and not self._laws[0]:
                    self._find_laws()
        return (*p[:OTHERS], np.array([*p[OTHERS:], *self._laws]), *self._addresses.values())

    def _home(self, name: str) -> Kernel:
        """Return the kernel that holds a function."""
        if name in SHARED:
            return kernel.load_any(self._problem, SHARED)
        if name in LANES:
            return kernel.load(self._problem, LANES, tuple(CALLED.values()), lanes=True)
        return self._own

    def numbers(self, table: Array) -> Array:
        """Return parameters (problems, parameters) as the solvers take them, (parameters + 5, problems), after :meth:`at`."""
        return np.ascontiguousarray(np.vstack([table.T, np.repeat(self._laws[:, None], len(table), axis=1)]))

    def _find_laws(self) -> None:
        forces = self._problem.forces
        laws, self._laws[-2] = kernel.load_laws(forces), any(force.is_rooted for force in forces)
        self._laws[-1] = kernel.size_of(self._problem) + sum(force.memory for force in forces)
        for place, (name, (_, types)) in enumerate(any_force.functions_of(forces).items()):
            self._laws[place] = laws.address(f"{name}_at", types)  # whole numbers below 2**53 are exact
