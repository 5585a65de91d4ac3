"""Compiles the solvers of a curve in processes of their own, while the first run of all compiles its tip equation.

Solvers are the same for all forces, so this happens once after an installation. Whoever needs a solver that is being compiled
waits for it; one that nobody has begun is compiled by whoever needs it. So a process that does not start, or ends, costs
time alone.
"""

from __future__ import annotations

import base64
import contextlib
import dataclasses
import multiprocessing
import pickle
import sys
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from dforce import kernel
from dforce.core.first_answer import may_go_on_beside
from dforce.core.parallel import cores
from dforce.kernel import behind, cache
from dforce.kernel.tip import Tip
from dforce.problem import Problem
from dforce.solvers.integrator import CALLED, load_kernels
from dforce.solvers.states import States

PROCESSES = (("follow",), ("relax", "remeasure"))  # what each compiles: half the time of all, and a quarter
RUN = "from dforce.solvers.beside import main; main()"
_BEGUN: set[tuple[int, int]] = set()  # numbers of modes, and of states of their fluid


def compile_beside(problem: Problem) -> None:
    """Begin to compile what follows curves of problems with as many modes, once, where a core is to spare for it."""
    kind, folder = (len(problem.modes), problem.late_fluid), cache.cache_folder()
    is_worker = multiprocessing.parent_process() is not None  # of those who share the cores already
    if kind in _BEGUN or is_worker or cores() < 2 or not may_go_on_beside() or not behind.can_keep(folder):
        return
    _BEGUN.add(kind)
    free = pickle.dumps(
        dataclasses.replace(problem, forces=(), places=())
    )  # without laws that only this process may know
    with contextlib.suppress(OSError):  # no more processes, or no such folder
        for names in PROCESSES:
            behind.start(RUN, [base64.b64encode(free).decode(), *names], folder)


def main() -> None:
    """Compile the solvers that the command line names, after a problem; the process that started this one wrote both."""
    _, free, *names = sys.argv
    compile_solvers(pickle.loads(base64.b64decode(free)), names)


def compile_solvers(problem: Problem, names: Sequence[str]) -> None:
    """Compile solvers for the arguments that a block of one problem calls them with, and run none."""
    from dforce.solvers import SolverSettings
    from dforce.solvers.block import Block

    class Unrun(Block):
        """A block whose solvers are compiled where they are called."""

        def __init__(self, *given: Any, **named: Any) -> None:
            super().__init__(*given, **named)
            own, solvers = load_kernels(self.lot.example)
            self._solvers, self._tip = _Compiled(solvers.module, solvers.what), _Unready(own, self.lot.example, CALLED)

    block, one = Unrun.of_one(problem, SolverSettings(), harmonics=1), np.zeros(1, np.int64)
    states = States(np.zeros((1, block.size)), np.empty((1, 0)), np.empty((1, 0)))
    monodromy, at = np.zeros((1, block.size, block.size)), np.zeros(1)
    calls: dict[str, Callable[[], Any]] = {
        "follow": lambda: block.follow(one, states, at, at[:, None]),
        "relax": lambda: block.relax(one, states, at),
        "remeasure": lambda: block.remeasure(one, states, at, monodromy),
    }
    for name in names:
        calls[name]()


class _Compiled(kernel.Kernel):
    """Solvers that are compiled in the place of being run."""

    def is_ready(self, name: str) -> bool:
        return True

    def entry(self, name: str) -> Callable[..., Any]:
        return lambda *arguments: self.compile_for(name, arguments)


class _Unready(Tip):
    """A tip equation that nothing is compiled of, because nobody calls it."""

    def at(self, p: tuple[float, ...], names: Sequence[str]) -> tuple[Any, ...]:
        return self.unready(p)
