"""Writes the module that holds one combination of modes and forces, and the loops over it, as text."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from dforce.forces import Force
from dforce.kernel.linker import Linker, signature_of

HEADER = '''"""Composed by dForce from {contents}; never edited, named by the hash of its content."""
import math
import numpy as np
from numba import njit

from dforce.kernel.unshared import unshared

# contract, arcp and nsz let the compiler fuse and reorder products but keep NaN and infinity meaningful; _nrt says whether
# references to arrays are counted, and goes over to what is called unless that says it, too
OPTIONS = dict(nogil=True, error_model="numpy", fastmath={{"contract", "arcp", "nsz"}}, _nrt=True)
# functions that Python never calls need no wrapper for it: that saves a third of the compile time
INNER = dict(no_cpython_wrapper=True, no_cfunc_wrapper=True, **OPTIONS)
compiled = njit(**INNER)
reordered = njit(**(INNER | dict(fastmath={{"contract", "arcp", "nsz", "reassoc"}}, _nrt=False)))
uncounted = njit(**(INNER | dict(_nrt=False)))
inlined = njit(forceinline=True, **(INNER | dict(_nrt=False)))
apart = unshared(uncounted)
entry = njit(**OPTIONS)
'''

# Columns of a tone's row: frequency ratio, phase, then real and imaginary part of the drive on each mode and of the base, and
# the offset of the detector's phase.
FIRST_DRIVE = 2

# Places of the parameters in the tuple p (CONTACT: a0); each mode adds three (stiffness, damping, gain); then come the rates
# and weights of the fluid's memory of one mode after the other, if it has one, and the forces'.
ZC, LENGTH, SPEED, OMEGA, CONTACT, FIRST_MODE, PER_MODE = 0, 1, 2, 3, 4, 5, 3


# The tip equation of the solvers, the same for all forces: the parameters up to CONTACT, an array of the others, and the
# addresses of the compiled functions that they call.
MOTION = "UniTuple(f8,{size})"
TIP = "Tuple(({numbers},f8[::1],{addresses}))"
OTHERS = CONTACT + 1
# gives the text of the number at a place, or of the tuple of several from there on
Number = Callable[[int, int | None], str]


def native_types(function: Callable[..., Any], size: int, addresses: int) -> str:
    """Return the types of a function that is called by its address, one of so many, for motions of so many numbers."""
    tip = TIP.format(numbers=",".join(OTHERS * ["f8"]), addresses=",".join(addresses * ["i8"]))
    return signature_of(function).format(y=MOTION.format(size=size), tip=tip)


def places_of(called: Sequence[Callable[..., Any]], size: int) -> dict[Callable[..., Any], tuple[int, str]]:
    """Return where in the tip equation the address of each function lies, and its types; for motions of so many numbers."""
    return {f: (OTHERS + 1 + i, native_types(f, size, len(called))) for i, f in enumerate(called)}


def pointers() -> str:
    """Return the text with which a module calls functions by their address."""
    return Path(__file__).with_name("pointers.py").read_text(encoding="utf-8")


def compose_solvers(
    modes: int, entries: dict[str, Callable[..., Any]], called: Sequence[Callable[..., Any]], late: int
) -> str:
    """Return the text of a module with entry functions that are the same for all forces.

    Parameters
    ----------
    modes
        Number of cantilever modes.
    entries
        The functions to be called from Python, by name.
    called
        The functions that they call by address, in the order of the addresses.
    late
        States of the fluid's memory of each mode.
    """
    count, first, size = len(called), OTHERS + 1, motion_size(modes, late)
    linker = Linker(elsewhere=places_of(called, size))
    linker.emit(HEADER.format(contents=f"{modes} mode{'s' * (modes > 1)} and any force"))
    linker.emit(pointers())
    linker.emit("def pointer(context, at):\n    return pointer_to(at)", "intrinsic")
    places, addresses = range(size), [f"p[{first + i}]" for i in range(count)]
    for text in (  # these return arrays, to which references are counted
        "def of_case(p, table, j, others):\n"
        f"    for k in range(others.shape[0]):\n        others[k] = table[{OTHERS} + k, j]\n"
        f"    return {tuple_of([*(f'table[{k}, j]' for k in range(OTHERS)), 'others', *addresses])}",
        # reshape brings code for the words of its errors, which takes a tenth of the time to compile all
        "def shaped(room, rows, columns, lanes):\n"
        "    return carray(pointer(room.ctypes.data), (rows, columns, lanes), np.float64)",
    ):
        linker.emit(text, "compiled")
    for text in (  # to numba a literal 1 has its own type, for which each callee would be compiled anew
        f"def mode_count():\n    return np.int64({modes})",
        f"def fluid_size():\n    return np.int64({late * modes})",
        f"def motion_size():\n    return np.int64({size})",
        *_samples(places),
    ):
        linker.emit(text, "inlined")
    for name, function in entries.items():
        linker.add_entry(function, name)
    return "\n\n".join(linker.text) + "\n"


def compose(
    modes: int,
    forces: Sequence[Force],
    entries: dict[str, Callable[..., Any]],
    called: Sequence[Callable[..., Any]] = (),
    late: int = 0,
    drive: tuple[int, bool] | None = None,
) -> str:
    """Return the text of a module with the composed tip equation and the given entry functions.

    Parameters
    ----------
    modes
        Number of cantilever modes.
    forces
        Bound forces; only their laws, layouts and numbers of states matter, not their parameters' values.
    entries
        The functions to be called from Python, by name, written over :mod:`dforce.kernel.vocabulary`.
    called
        All functions that the solvers call by address, in the order of the addresses. Other modules hold the functions that
        are no entries.
    late
        States of the fluid's memory of each mode.
    drive
        Number of drive tones, and whether they may have imaginary parts, which take longer: lanes alone are compiled for these.
    """
    sizes = sizes_of(modes, forces, late)
    elsewhere = places_of(called, sizes["motion_size"])
    linker = Linker(sizes, {f: place for f, place in elsewhere.items() if f not in entries.values()})
    names = " + ".join(force.name for force in forces) or "no force"
    linker.emit(HEADER.format(contents=f"{modes} mode{'s' * (modes > 1)} and {names}"))
    if called:
        linker.emit(pointers())
    count = parameter_count(modes, late) + sum(len(force.numbers()) for force in forces)
    for text in (*shared_text(modes, late), *_unpacked(count, bool(called)), *(_lanes(modes, *drive) if drive else ())):
        linker.emit(text, "inlined")
    rooted = f"def is_rooted(p):\n    return {any(force.is_rooted for force in forces)}"
    begin = f"def branches_begin(p):\n    return {sizes['motion_size'] + sizes['memory_size']}"
    for text in (rooted, begin, *forces_text(linker, parameter_count(modes, late), forces)):
        linker.emit(text, "inlined")
    for name, function in entries.items():
        linker.add_entry(function, name)
    return "\n\n".join(linker.text) + "\n"


def parameter_count(modes: int, late: int) -> int:
    """Return the place in `p` of the first force's first argument."""
    return FIRST_MODE + (PER_MODE + 2 * late) * modes


def motion_size(modes: int, late: int) -> int:
    """Return the number of numbers of a motion: deflections, velocities, and `late` states of the fluid of each mode."""
    return (2 + late) * modes


def sizes_of(modes: int, forces: Sequence[Force], late: int) -> dict[str, int]:
    """Return the values of the vocabulary's functions without arguments."""
    memory = sum(force.memory for force in forces)
    latches = sum(force.switch is not None for force in forces)
    return {
        "mode_count": modes,
        "memory_size": memory,
        "latch_count": latches,
        "has_states": int(memory + latches > 0),
        "fluid_size": late * modes,
        "motion_size": motion_size(modes, late),
    }


def shared_text(modes: int, late: int) -> list[str]:
    """Return the functions that are the same for all forces."""
    places = range(motion_size(modes, late))
    return [
        *_kinematics(modes, late),
        *_arithmetic(modes, late),
        f"def column(lanes, j):\n    return {tuple_of([f'lanes[{k}, j]' for k in places])}",
        "def put_column(lanes, j, y):\n" + "\n".join(f"    lanes[{k}, j] = y[{k}]" for k in places),
    ]


def tuple_of(parts: Sequence[str]) -> str:
    """Return the text of a tuple."""
    return f"({', '.join(parts)},)"


def _pairs(modes: int, late: int, x: str, v: str) -> str:
    """Return the text of a motion from the forms of deflections and velocities, with their places and the mode's.

    The states of the fluid are y's.
    """
    moves = [form.format(x=i, v=i + 1, n=i // 2) for i in range(0, 2 * modes, 2) for form in (x, v)]
    return tuple_of([*moves, *(f"y[{k}]" for k in range(2 * modes, motion_size(modes, late)))])


def _fluid(modes: int, late: int) -> list[str]:
    """Return the functions of the fluid's memory; they are called only where it has one."""
    if not late:
        return []
    places = range(2 * modes, motion_size(modes, late))
    rates = FIRST_MODE + PER_MODE * modes
    slopes = [
        f"p[{rates + 2 * late * n + k}] * (y[{2 * n + 1}] - y[{2 * modes + late * n + k}])"
        for n in range(modes)
        for k in range(late)
    ]
    grown = [f"start[{k}] + h * slopes[{k - 2 * modes}]" for k in places]
    mean = [f"(k1[{k}] + 2.0 * (k2[{k}] + k3[{k}]) + k4[{k}]) / 6.0" for k in range(late * modes)]
    return [
        f"def fluid_slopes(y, p):\n    return {tuple_of(slopes)}",
        f"def followed(y, start, h, slopes):\n    return {tuple_of([*(f'y[{k}]' for k in range(2 * modes)), *grown])}",
        f"def fluid_mean(k1, k2, k3, k4):\n    return {tuple_of(mean)}",
    ]


def _kinematics(modes: int, late: int) -> list[str]:
    n = range(modes)
    x = " + ".join(f"y[{2 * i}]" for i in n)
    v = " + ".join(f"y[{2 * i + 1}]" for i in n)
    place = [FIRST_MODE + PER_MODE * i for i in n]
    free = [f"u[{i}] - p[{place[i]}] * y[{2 * i}] - p[{place[i] + 1}] * y[{2 * i + 1}]" for i in n]
    weights = FIRST_MODE + PER_MODE * modes + late
    free = [
        " + ".join([one, *(f"p[{weights + 2 * late * i + k}] * y[{2 * modes + late * i + k}]" for k in range(late))])
        for i, one in enumerate(free)
    ]
    accelerations = [f"a[{i}] + p[{place[i] + 2}] * f" for i in n]
    gains = " + ".join(f"p[{place[i] + 2}]" for i in n)
    slopes = [part for i in n for part in (f"y[{2 * i + 1}]", f"a[{i}]")] + [f"q[{k}]" for k in range(late * modes)]
    with_fluid = "    q = fluid_slopes(y, p)\n" if late else ""
    sums = "\n".join(f"    u{i} = 0.0" for i in n)
    re, im = FIRST_DRIVE, FIRST_DRIVE + modes
    adds = "\n".join(f"        u{i} += tones[j, {re + i}] * c - tones[j, {im + i}] * s" for i in n)
    return [
        f"def distance(y, p):\n    return p[{ZC}] + p[{LENGTH}] * ({x})",
        f"def rate_of(y, p):\n    return p[{SPEED}] * ({v})",
        f"def free_acceleration(u, y, p):\n    return {tuple_of(free)}",
        f"def forced(a, f, p):\n    return {tuple_of(accelerations)}",
        *_fluid(modes, late),
        f"def motion(u, f, y, p):\n    a = forced(free_acceleration(u, y, p), f, p)\n{with_fluid}    return {tuple_of(slopes)}",
        f"def yielding(p):\n    return p[{LENGTH}] * ({gains})",
        "def drive_between(u0, u1, u2, s):\n"
        "    w0, w1, w2 = (1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)\n"
        f"    return {tuple_of([f'w0 * u0[{i}] + w1 * u1[{i}] + w2 * u2[{i}]' for i in n])}",
        f"def row(table, i):\n    return {tuple_of([f'table[i, {k}]' for k in n])}",
        f"def drive_at(tones, bases, tau):\n{sums}\n    for j in range(tones.shape[0]):\n"
        f"        angle = tones[j, 0] * tau + bases[j]\n        c, s = math.cos(angle), math.sin(angle)\n{adds}\n"
        f"    return {tuple_of([f'u{i}' for i in n])}",
    ]


def _arithmetic(modes: int, late: int) -> list[str]:
    places, form = range(motion_size(modes, late)), functools.partial(_pairs, modes, late)
    # the last acceleration comes last: the next step waits for these sums
    arrived_x = "y[{x}] + h * s * (a1[{n}] + a2[{n}]) + h * s * a3[{n}]"
    arrived_v = "y[{v}] + s * (a1[{n}] + 2.0 * (a2[{n}] + a3[{n}])) + s * a4[{n}]"
    blended = [f"y[{i}] + (share1 * y1[{i}] + share2 * y2[{i}] + (-share1 - share2) * y[{i}])" for i in places]
    return [
        f"def coasted(y, h):\n    return {form('y[{x}] + h * y[{v}]', 'y[{v}]')}",
        f"def bent(y, h, a):\n    return {form('y[{x}] + h * a[{n}]', 'y[{v}]')}",
        f"def pushed(y, h, a):\n    return {form('y[{x}]', 'y[{v}] + h * a[{n}]')}",
        f"def arrived(y, h, a1, a2, a3, a4):\n    s = h / 6.0\n    return {form(arrived_x, arrived_v)}",
        f"def blend(y, share1, y1, share2, y2):\n    return {tuple_of(blended)}",
        *_samples(places),
    ]


def _samples(places: Sequence[int]) -> list[str]:
    return [
        f"def motion_of(samples, i):\n    return {tuple_of([f'samples[i, {k}]' for k in places])}",
        "def keep(samples, i, y):\n" + "\n".join(f"    samples[i, {k}] = y[{k}]" for k in places),
        f"def from_vector(vector):\n    return {tuple_of([f'vector[{k}]' for k in places])}",
    ]


def _unpacked(parameters: int, by_address: bool) -> list[str]:
    first = [f"p[{k}]" for k in range(OTHERS)]
    others = [f"others[{k}]" for k in range(parameters - OTHERS)]
    numbers = tuple_of([*first, *others]) if by_address else "p"
    return [
        f"def parameters_of(table, j):\n    return {tuple_of([f'table[{k}, j]' for k in range(parameters)])}",
        f"def unpacked(tip):\n    p, others = tip, tip[{OTHERS}]\n    return {numbers}",
    ]


def _lanes(modes: int, tones: int, lagging: bool) -> list[str]:
    waves = range(0, 2 * tones, 1 if lagging else 2)
    products = [[f"amplitudes[{k * modes + n}, j] * c[{i}]" for i, k in enumerate(waves)] for n in range(modes)]
    drive = [" + ".join(terms) for terms in products]
    return [
        f"def waves_at(waves, i):\n    return {tuple_of([f'waves[{k}, i]' for k in waves])}",
        f"def lane_drive(amplitudes, j, c):\n    return {tuple_of(drive)}",
    ]


def number_of(place: int, several: int | None) -> str:
    """Return the text of parameters of `p`; see :data:`Number`."""
    return f"p[{place}]" if several is None else f"p[{place}:{place + several}]"


def calls_of(
    force: Force, linker: Linker, motion: str, states: tuple[str, str, str, str], place: int, number: Number
) -> Iterator[tuple[str, str]]:
    """Give the calls of the functions of a force by their kind: law, evolve, switch.

    `states` are the texts of memory, its change, latch and average distance; `number` gives its numbers from `place` on.
    """
    (memory, change, latched, zc), given = states, []
    for several in force.layout():
        given.append(number(place, several))
        place += 1 if several is None else several
    wanted = (memory, force.evolve is not None), (latched, force.switch is not None), (zc, "zc" in force.leading())
    own = [name for name, is_taken in wanted if is_taken]
    yield "law", f"{linker.add(force.law_function())}({', '.join([motion, *own, *given])})"
    if force.evolve is not None:
        yield "evolve", f"{linker.add(force.evolve)}({', '.join([motion, memory, change, *given])})"
    if force.switch is not None:
        yield "switch", f"{linker.add(force.switch)}({', '.join([latched, motion, *given])})"


def forces_text(linker: Linker, place: int, forces: Sequence[Force], number: Number = number_of) -> list[str]:
    """Return the functions that sum the forces; their first number is at `place`, and `number` gives each."""
    state, latch = 0, 0
    terms, evolutions, switches = [], [], []
    for force in forces:
        after = state + force.memory
        states = f"memory[{state}:{after}]", f"change[{state}:{after}]", f"latched[{latch}]", f"p[{ZC}]"
        for kind, call in calls_of(force, linker, "d, rate, t", states, place, number):
            if kind == "law":
                terms.append(call)
            elif kind == "evolve":
                evolutions.append(f"    {call}")
            else:
                switches.append(f"    if which == {latch}:\n        return {call}")
        place, state, latch = place + len(force.numbers()), after, latch + (force.switch is not None)
    scale = f"    for i in range({state}):\n        change[i] /= p[{OMEGA}]" if evolutions else "    pass"
    return [
        f"def force(d, rate, t, memory, latched, p):\n    return {' + '.join(terms) or '0.0'}",
        "def each_force(d, rate, t, step, out, p):\n    for i in range(out.shape[0]):\n"
        "        out[i] = force(d[i], rate[i], t + i * step, None, None, p)",
        "def evolve(d, rate, t, memory, change, p):\n" + "\n".join([*evolutions, scale]),
        "def switch(which, latched, d, rate, t, p):\n" + "\n".join([*switches, "    return -1.0"]),
    ]
