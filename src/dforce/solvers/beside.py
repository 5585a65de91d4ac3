"""Compile the solvers ahead, in background processes: once after an installation, for all forces alike.

Where the answer may be early, Python itself runs the solvers meanwhile: all that they wait for is one period of the motion. One
process compiles that, beside the tip equation; the rest it compiles when nobody waits any more. Elsewhere what follows
a curve is compiled beside the tip equation. Whoever needs a solver that is being compiled waits for it; one that nobody
has begun is compiled by whoever needs it. So a process that does not start, or ends, costs time alone.
"""

from __future__ import annotations

import base64
import contextlib
import dataclasses
import multiprocessing
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dforce import kernel
from dforce.core import log
from dforce.core.first_answer import may_be_early, may_go_on_beside
from dforce.core.parallel import cores
from dforce.kernel import behind, cache
from dforce.kernel.tip import TipFunctions
from dforce.problem import Problem
from dforce.solvers.integrator import CALLED, load_kernels
from dforce.solvers.newton import empty_orbits
from dforce.solvers.states import States

PROCESSES = (("follow",), ("relax", "remeasure"))  # what each compiles: half the time of all, and a quarter
WORK = "march"  # the solver that does the others' work: they take no time worth compiling but for this
LATER = ("follow", "relax", "remeasure", "advance_block", "find_orbits", "take_steps")
# so many orbits Python finds faster than the solver is compiled; of those that are not named here any number
FEW = {"follow": 512, "relax": 32, "advance_block": 64}
RUN = "from dforce.solvers.beside import main; main()"
_BEGINNING = threading.Lock()
_BESIDE: set[tuple[int, int]] = set()  # numbers of modes, and of states of their fluid
_BEHIND: dict[tuple[int, int], subprocess.Popen[bytes]] = {}  # by the same


class Order(NamedTuple):
    """What a process compiles: solvers for a problem, functions with their types of a text's file, then solvers at leisure."""

    problem: Problem
    solvers: Sequence[str]
    file: Path | None = None
    functions: Mapping[str, str] | None = None
    later: Sequence[str] = ()


def solver(solvers: kernel.Kernel, name: str, orbits: int, problem: Problem, tip: TipFunctions) -> Callable[..., Any]:
    """Return a solver for so many orbits of such problems: as Python runs it, where nobody is to wait for a compiler."""
    if not solvers.is_ready(name):
        if orbits <= FEW.get(name, orbits) and may_be_early() and compile_behind(problem, tip):
            return solvers.interpreted(name, WORK)
        if any(name in names for names in PROCESSES):
            compile_beside(problem)
    return solvers.entry(name)


def compile_beside(problem: Problem) -> None:
    """Begin to compile what follows curves of problems with as many modes, once, where a core is to spare for it."""
    kind = len(problem.modes), problem.late_fluid
    with _BEGINNING, contextlib.suppress(OSError):  # no more processes, or no such folder
        if kind not in _BESIDE and _may_begin():
            _BESIDE.add(kind)
            for names in PROCESSES:
                _start(Order(problem, names))


def compile_behind(problem: Problem, tip: TipFunctions) -> bool:
    """Begin to compile what runs wait for, then all solvers for as many modes; say whether that goes on."""
    kind = len(problem.modes), problem.late_fluid
    with _BEGINNING:
        if kind not in _BEHIND:
            if not _may_begin():
                return False
            try:
                _BEHIND[kind] = _start(Order(problem, [WORK], *tip.code("measure_force"), LATER))
            except OSError:
                return False
            log.announce("Compiling the solvers in the background; until then, curves take more time.")
        return _BEHIND[kind].poll() is None


def _may_begin() -> bool:
    is_worker = multiprocessing.parent_process() is not None  # of those who share the cores already
    return not is_worker and cores() > 1 and may_go_on_beside() and behind.can_keep(cache.cache_folder())


def _start(order: Order) -> subprocess.Popen[bytes]:
    free = dataclasses.replace(order.problem, forces=(), places=())  # without laws that only this process may know
    text = base64.b64encode(pickle.dumps(order._replace(problem=free))).decode()
    return behind.start(RUN, [text], cache.cache_folder())


def main() -> None:
    """Compile what the command line holds, an order of the process that started this one."""
    behind.end_in_time()
    order: Order = pickle.loads(base64.b64decode(sys.argv[1]))
    compile_solvers(order.problem, order.solvers)
    if order.file is not None and order.functions is not None:
        behind.compile_all(order.file, order.functions)
    behind.give_way()
    compile_solvers(order.problem, order.later)


def compile_solvers(problem: Problem, names: Sequence[str]) -> None:
    """Compile solvers for the arguments that a block of one problem calls them with, and run none."""
    from dforce.solvers import SolverSettings
    from dforce.solvers.block import Block

    class Unrun(Block):
        """A block whose solvers are compiled where they are called."""

        def __init__(self, *given: Any, **named: Any) -> None:
            super().__init__(*given, **named)
            own, solvers = load_kernels(self.batch.example)
            self._solvers, self._tip = (
                _Compiled(solvers.module, solvers.what),
                _Unready(own, self.batch.example, CALLED),
            )

    block, one = Unrun.of_one(problem, SolverSettings(), harmonics=1), np.zeros(1, np.int64)
    states = States(np.zeros((1, block.size)), np.empty((1, 0)), np.empty((1, 0)))
    monodromy, at = np.zeros((1, block.size, block.size)), np.zeros(1)
    slots, orbits = block.slots(states, at), empty_orbits(1, block.size)
    calls: dict[str, Callable[[], Any]] = {
        "march": lambda: block.march(slots),
        "advance_block": lambda: block.advance(one, states, at, 1),
        "find_orbits": lambda: block.find(slots, orbits, 1),
        "take_steps": lambda: block.take_step(slots, 1, orbits),
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


class _Unready(TipFunctions):
    """A tip equation that nothing is compiled of, because nobody calls it."""

    def at(self, p: tuple[float, ...], names: Sequence[str]) -> tuple[Any, ...]:
        return self.unready(p)
