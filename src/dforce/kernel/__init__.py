"""The compiled tip equation: the chosen forces composed into one module, kept on disk."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from dforce.core import log
from dforce.core.arrays import Array, Complexes
from dforce.core.errors import ForceError, shorten
from dforce.core.stopping import unbroken
from dforce.forces import Force, check_answers, read_by
from dforce.kernel import any_force, cache, compiling, texts
from dforce.kernel.codegen import (
    FIRST_DRIVE,
    FIRST_MODE,
    PER_MODE,
    compose,
    compose_solvers,
    motion_size,
    parameter_count,
)
from dforce.kernel.whole import is_part
from dforce.problem import Problem

TWO_PI = 2.0 * np.pi


@dataclass(frozen=True)
class Scales:
    """The units that a problem is solved in: length (m), angular frequency (rad/s)."""

    length: float
    omega: float

    @property
    def speed(self) -> float:
        """Unit of velocity (m/s)."""
        return self.length * self.omega


def scales(problem: Problem) -> Scales:
    """Return the scales of a problem: the first tone's free amplitude and angular frequency."""
    first = problem.tones[0]
    return Scales(first.A0, TWO_PI * first.frequency)


def parameters(problem: Problem, zc: float) -> tuple[float, ...]:
    """Return the kernel's parameter tuple for one average distance (m).

    Raises
    ------
    ParameterError
        Where the lever changes with its height, and no height was chosen.
    """
    problem.refuse_changing_lever("this")
    scale = scales(problem)
    numbers = [zc, scale.length, scale.speed, scale.omega, problem.a0]
    for mode in problem.modes:
        frequency, Q = mode.oscillator
        ratio = TWO_PI * frequency / scale.omega
        numbers += [ratio**2, ratio / Q, ratio**2 / (mode.k * scale.length)]
    for mode in problem.modes:
        if mode.memory is not None:
            numbers += [value / scale.omega for value in (*mode.memory.rates, *mode.memory.weights)]
    for force in problem.forces:
        numbers += force.numbers()
    return tuple(map(float, numbers))


def tone_table(problem: Problem) -> Array:
    """Return the drive, a row for each tone.

    Columns: frequency ratio; phase; real parts, then imaginary parts, of the scaled drive on each mode; real and imaginary part
    of the base's scaled motion; offset of the detector's phase. The base's motion is counted to the tone's own mode.
    """
    scale, modes = scales(problem), len(problem.modes)
    table = np.empty((len(problem.tones), FIRST_DRIVE + 2 * modes + 3))
    for j, tone in enumerate(problem.tones):
        table[j, :FIRST_DRIVE] = TWO_PI * tone.frequency / scale.omega, tone.phase
        for n, mode in enumerate(problem.modes):
            ratio = TWO_PI * mode.oscillator[0] / scale.omega
            force, unit = problem.tip_drive[j, n], mode.k * scale.length
            # part by part, as the table of a sweep: a complex quotient is rounded otherwise
            table[j, FIRST_DRIVE + n], table[j, FIRST_DRIVE + modes + n] = (
                ratio**2 * part / unit for part in (force.real, force.imag)
            )
        base = problem.base[j]
        turn = problem.readout.turns[j] if problem.readout.turns else 0.0
        table[j, FIRST_DRIVE + 2 * modes :] = base.real / scale.length, base.imag / scale.length, turn
    return table


def modes_of(numbers: Array, modes: int) -> Array:
    """Return scaled stiffness, damping and gain of each mode from parameters (..., parameters), (..., modes, 3)."""
    return numbers[..., FIRST_MODE : FIRST_MODE + PER_MODE * modes].reshape(*numbers.shape[:-1], modes, PER_MODE)


def stiffness_of(numbers: Array, modes: int, late: int, omega: Array) -> Complexes:
    """Return the scaled force over deflection of each mode at scaled angular frequencies, (..., modes).

    `numbers` are parameters (..., parameters), `late` the states of the fluid's memory of each mode, `omega` (..., modes).
    """
    lever = modes_of(numbers, modes)
    fluid = numbers[..., FIRST_MODE + PER_MODE * modes : parameter_count(modes, late)]
    fluid = fluid.reshape(*numbers.shape[:-1], modes, 2, late)
    rates, weights = fluid[..., 0, :], fluid[..., 1, :]
    drag = lever[..., 1] - (weights * rates / (rates + 1j * omega[..., None])).sum(axis=-1)
    return np.asarray(lever[..., 0] - omega**2 + 1j * omega * drag)


def drive_of(tones: Array, modes: int) -> Complexes:
    """Return the complex drive that tone tables (..., tones, columns) hold, (..., tones, modes)."""
    parts = tones[..., FIRST_DRIVE : FIRST_DRIVE + 2 * modes]
    return np.asarray(parts[..., :modes] + 1j * parts[..., modes:])


def size_of(problem: Problem) -> int:
    """Return the number of numbers of a problem's motion."""
    return motion_size(len(problem.modes), problem.late_fluid)


def units_of(problem: Problem, length: Any, speed: Any) -> Array:
    """Return the unit of each number of a problem's motion, (..., numbers); the fluid's are velocities."""
    modes = len(problem.modes)
    return np.stack([length, speed] * modes + [speed] * modes * problem.late_fluid, axis=-1)


def steady_fluid_memory(numbers: Array, problem: Problem, omega: Array, speeds: Any) -> Array:
    """Return the states of the fluid's memory behind steady motion, (..., numbers); see `fluid_amplitudes`."""
    return np.asarray(fluid_amplitudes(numbers, problem, omega, speeds).sum(axis=-2).real)


def fluid_amplitudes(numbers: Array, problem: Problem, omega: Array, speeds: Any) -> Complexes:
    """Return the complex states of the fluid's memory behind steady motion, (..., tones, numbers).

    Parameters
    ----------
    numbers
        The kernel's parameters, (..., parameters).
    omega, speeds
        Scaled angular frequencies of the tones, and complex velocities of the modes at each, (..., tones, modes).
    """
    modes, late = len(problem.modes), problem.late_fluid
    fluid = numbers[..., FIRST_MODE + PER_MODE * modes : parameter_count(modes, late)]
    rates = fluid.reshape(*numbers.shape[:-1], 1, modes, 2, late)[..., 0, :]
    behind = rates / (rates + 1j * omega[..., :, None, None]) * speeds[..., None]
    return np.asarray(behind.reshape(*behind.shape[:-2], modes * late))


def base_of(tones: Array) -> Complexes:
    """Return the scaled complex motion of the base that tone tables (..., tones, columns) hold, (..., tones)."""
    return np.asarray(tones[..., -3] + 1j * tones[..., -2])


def base_in_motion(problem: Problem, tones: Array) -> Array:
    """Return the base's share of the scaled motion, (..., numbers), from tone tables (..., tones, columns).

    The motion is that at the start of a common period. Of the problem only the tones' own modes count. The states of the
    fluid's memory, behind, follow base and deflection together, and stay.
    """
    base = base_of(tones) * np.exp(1j * tones[..., 1])
    moved = np.zeros((*tones.shape[:-2], size_of(problem)))
    for j, n in enumerate(problem.own_modes):
        moved[..., 2 * n] += base[..., j].real
        moved[..., 2 * n + 1] -= tones[..., j, 0] * base[..., j].imag
    return moved


def responses(problem: Problem) -> Array:
    """Return the coefficients with which ``solvers.model`` moves each tone's row to another frequency, (tones, coefficients).

    There are none where a force drives the lever.
    """
    if problem.shaken is None:
        return np.empty((len(problem.tones), 0))
    rows = []
    for tone in problem.tones:
        row, late, omega = np.zeros((3, len(problem.modes))), [], TWO_PI * tone.frequency
        for n, mode in enumerate(problem.modes):
            frequency, Q = mode.oscillator
            ratio, own, (mass, drag) = frequency / tone.frequency, float(n == tone.mode), problem.shaken.couplings(mode)
            row[:, n] = mass - own, ratio / Q * (own - drag), ratio**2 * own
            if mode.memory is not None:
                late += [rate / omega for rate in mode.memory.rates]
                late += [weight * Q / (TWO_PI * frequency) for weight in mode.memory.weights]
        rows.append([*row.ravel(), tone.frequency / problem.shaken.piezo_f0, problem.shaken.piezo_Q, *late])
    return np.array(rows)


def kink_distances(problem: Problem) -> Array:
    """Return the distances (m) where a force of the problem is not smooth."""
    return np.array(sorted({kink for force in problem.forces for kink in force.kinks()}), dtype=float)


class Kernel:
    """A composed module: the tip equation of one combination of modes and forces, or the solvers that call it.

    ``solvers.compiled`` names its entry functions.

    Parameters
    ----------
    module
        The module with the functions.
    title
        Its name in messages; several kernels may share it.
    usual
        Entry functions that nearly every use compiles.
    """

    def __init__(self, module: ModuleType, title: str, usual: Sequence[str] = ()) -> None:
        self.module = module
        self.title = title
        self.usual = usual
        self._entries: dict[str, Callable[..., Any]] = {}
        self._addresses: dict[str, int] = {}

    def is_ready(self, name: str) -> bool:
        """Return whether compiled code of an entry function is in memory or on disk."""
        return name in self._addresses or name in self._entries or cache.is_compiled(self.module, name)

    def entry(self, name: str) -> Callable[..., Any]:
        """Return an entry function; its first call compiles it or loads it from disk."""
        return self._entries.get(name) or self._first(name)

    def address(self, name: str, types: str) -> int:
        """Return where in memory the compiled code for these types lies, to be called by other compiled code."""
        if name not in self._addresses:
            function = getattr(self.module, name)
            with self._made_ready(name):
                function.compile(types)
                [compiled] = function.overloads.values()
                new = is_part(compiled.library)
                self._addresses[name] = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
                if new:
                    function._cache.save_overload(types, compiled)
        return self._addresses[name]

    @contextlib.contextmanager
    def _made_ready(self, name: str) -> Iterator[None]:
        """Compile or load a function inside; threads and processes that want the same code compiled wait for it."""
        with log.done_once():
            if cache.is_compiled(self.module, name):
                with cache.alone(), unbroken():
                    yield
                return
            if self.title not in _ANNOUNCED or log.is_heard():  # printed once, and passed to each listener
                _ANNOUNCED.add(self.title)
                how = "at each start" if cache.complaints() else "once; it is kept on disk"
                log.announce(f"Compiling {self.title} ({how}) ...")
            with cache.one_at_a_time(self.module, name), compiling.watched(self, name, _KERNELS.values()):
                try:
                    yield
                except Exception as error:
                    if type(error).__module__ != "numba.core.errors":
                        raise
                    lines = [line for line in str(error).splitlines() if line and not line.startswith("Failed in")]
                    raise ForceError(f"{self.title} cannot be compiled: {shorten(lines[0], 200)}") from error

    def _first(self, name: str) -> Callable[..., Any]:
        function = getattr(self.module, name)

        def first(*arguments: Any) -> Any:
            if name not in self._entries:
                import numba

                with self._made_ready(name):  # compiled for arguments of such types, and not run
                    function.compile(tuple(map(numba.typeof, arguments)))
                self._entries[name] = function
            return function(*arguments)

        return first


def signature(force: Force) -> tuple[Any, ...]:
    """Return the parts of a force that decide its compiled form: law, numbers of states and arguments, and roots."""
    parts = type(force), force.law_function(), force.memory, force.layout(), force.is_rooted
    if texts.is_shipped(force):
        return parts
    laws = [law for law in (force.law_function(), force.evolve, force.switch) if law is not None]
    return *parts, *(part for law in laws for part in read_by(law))  # a notebook may define these anew


def load(
    problem: Problem,
    entries: dict[str, Callable[..., Any]],
    called: Sequence[Callable[..., Any]] = (),
    lanes: bool = False,
) -> Kernel:
    """Return the kernel of a problem's combination of modes and forces.

    Parameters
    ----------
    problem
        The problem to solve; its numbers matter only where they choose the laws of the forces.
    entries
        Entry functions by name, written over :mod:`dforce.kernel.vocabulary`.
    called
        All functions that the solvers call by address, see :func:`codegen.compose`.
    lanes
        Whether they march lanes, and so are compiled for the number of tones.
    """
    modes, late, forces = len(problem.modes), problem.late_fluid, problem.forces
    drive = (len(problem.tones), problem.lagging) if lanes else None
    text = functools.partial(compose, modes, forces, entries, called, late, drive)
    return _loaded(("tip", modes, late, drive), forces, (entries, called), text, _tip_equation_for(forces))


def load_solvers(
    modes: int,
    entries: dict[str, Callable[..., Any]],
    called: Sequence[Callable[..., Any]],
    late: int,
    usual: Sequence[str],
) -> Kernel:
    """Return the entry functions that are the same for all forces; their callees are in other kernels."""
    text = functools.partial(compose_solvers, modes, entries, called, late)
    return _loaded(("solvers", modes, late), (), (entries, called), text, _solvers_for(modes), usual)


def load_any(problem: Problem, entries: dict[str, Callable[..., Any]]) -> Kernel:
    """Return functions that are the same for any forces with states, or for any without, see ``any_force``."""
    modes, late, functions = len(problem.modes), problem.late_fluid, any_force.functions_of(problem.forces)
    text = functools.partial(any_force.compose_any, modes, late, functions, entries)
    numbers = ("any", modes, late, tuple(functions))
    return _loaded(numbers, (), (entries, ()), text, _solvers_for(modes), tuple(entries))


def load_laws(forces: Sequence[Force]) -> Kernel:
    """Return the functions that these entry functions call: the sums of some laws."""
    text = functools.partial(any_force.compose_laws, forces)
    return _loaded(("laws",), forces, ({}, ()), text, _tip_equation_for(forces))


def _solvers_for(modes: int) -> str:
    return f"the solvers for {modes} mode{'s' * (modes > 1)}"


def _tip_equation_for(forces: Sequence[Force]) -> str:
    return f"the tip equation for {' + '.join(force.name for force in forces) or 'a free tip'}"


def _loaded(
    numbers: tuple[Any, ...],
    forces: Sequence[Force],
    functions: tuple[dict[str, Callable[..., Any]], Sequence[Callable[..., Any]]],
    text: Callable[[], str],
    title: str,
    usual: Sequence[str] = (),
) -> Kernel:
    """Return the kernel of this process for a combination; its text is read from disk, or made if missing.

    `functions` are the entry functions by name, and the functions that the solvers call by address.
    """
    for force in forces:
        if not texts.is_shipped(force):
            check_answers(force)
    (entries, called), signatures = functions, [signature(force) for force in forces]
    key = numbers, *signatures, *entries.items(), *called
    if key not in _KERNELS:
        names = [(function.__module__, function.__qualname__) for function in (*entries.values(), *called)]
        parts = numbers, [rest for _, _, *rest in signatures], list(entries), names
        _KERNELS[key] = Kernel(cache.load(texts.remembered(parts, forces, text)), title, usual)
    return _KERNELS[key]


_ANNOUNCED: set[str] = set()  # announced compilations of this process
_KERNELS: dict[tuple[Any, ...], Kernel] = {}  # of this process; the parameters' values are no part of the key
