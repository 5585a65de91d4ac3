"""Code that is compiled once for any sum of forces, and calls their laws by address.

Beside the motion this code receives whole numbers on the forces: first the address of the first number of their laws, and the
distance of the next number (bytes). The last parameters are the addresses of the compiled functions, whether a law begins like
a root beside a kink, and the column of samples before their branches. The text depends on the numbers
of modes and of states of the fluid, and on whether forces have states; not on the number of states or tones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from dforce.forces import Force
from dforce.kernel.codegen import (
    HEADER,
    OMEGA,
    OTHERS,
    forces_text,
    parameter_count,
    pointers,
    shared_text,
    sizes_of,
    tuple_of,
)
from dforce.kernel.linker import Linker

# the first parameters, which laws may ask for, the place of their own and the way to the next, and the addresses
LAWS = "Tuple((f8,f8,f8,f8,i8,i8,i8,i8,i8))"
FIRST = OMEGA + 1
STATES = "f8[::1],f8[::1]"
Functions = dict[str, tuple[str, str]]
# the arguments of each function with their types: for forces that are functions of motion and time, and for all others
PLAIN = {
    "force": ("d, rate, t", f"f8(f8,f8,f8,{LAWS})"),
    "each_force": ("d, rate, t, step, out", f"void(f8[::1],f8[::1],f8,f8,f8[::1],{LAWS})"),
}
WITH_STATES = {
    "force": ("d, rate, t, memory, latched", f"f8(f8,f8,f8,{STATES},{LAWS})"),
    "evolve": ("d, rate, t, memory, change", f"void(f8,f8,f8,f8[::1],f8[::1],{LAWS})"),
    "switch": ("which, latched, d, rate, t", f"f8(i8,f8[::1],f8,f8,f8,{LAWS})"),
}


def functions_of(forces: Sequence[Force]) -> Functions:
    """Return the functions of forces that are called by address: the arguments of each, and their types."""
    return WITH_STATES if any(force.memory or force.switch is not None for force in forces) else PLAIN


def _given(name: str) -> str:
    """Return the arguments of a function of the vocabulary, the same for all forces."""
    return (PLAIN | WITH_STATES)[name][0]


def compose_any(modes: int, late: int, functions: Functions, entries: dict[str, Callable[..., Any]]) -> str:
    """Return the text of a module with entry functions for any forces, see ``codegen.compose``.

    Of the forces only `functions_of` them counts. The code reads from its arrays how many states they have.
    """
    sizes = sizes_of(modes, (), late) | {"has_states": int(functions is WITH_STATES)}
    if functions is WITH_STATES:
        del sizes["memory_size"], sizes["latch_count"]
    linker = Linker(sizes)
    linker.emit(HEADER.format(contents=f"{modes} mode{'s' * (modes > 1)} and any force"))
    linker.emit(pointers())
    first = parameter_count(modes, late)
    for text in (*shared_text(modes, late), *_lanes(modes, first)):
        linker.emit(text, "inlined")
    laws = tuple_of([*(f"p[{k}]" for k in range(FIRST)), *(f"p[{first + k}]" for k in range(5))])
    linker.emit(f"def is_rooted(p):\n    return p[{first + 5}] == 1", "inlined")
    if functions is WITH_STATES:
        for name in ("memory_size", "latch_count"):
            linker.emit(f"def {name}(states):\n    return states.shape[0]", "inlined")
    linker.emit(f"def branches_begin(p):\n    return p[{first + 6}]", "inlined")
    for place, (name, (taken, types)) in enumerate(functions.items(), FIRST + 2):
        tip = taken.count(",") + 1
        text = f"def {name}_at(context, {taken}, p):\n    return call_by_address({types!r}, {tip}, {place}, {taken}, p)"
        linker.emit(text, "intrinsic")
        linker.emit(f"def {name}({_given(name)}, p):\n    return {name}_at({taken}, {laws})", "inlined")
    if "switch" not in functions:
        linker.emit("def switch(which, latched, d, rate, t, p):\n    return -1.0", "inlined")
    for name, function in entries.items():
        linker.add_entry(function, name)
    return "\n\n".join(linker.text) + "\n"


def compose_laws(forces: Sequence[Force]) -> str:
    """Return the text of a module with the functions of some forces that are called by their address, see `functions_of`."""
    linker = Linker()
    linker.emit(HEADER.format(contents=" + ".join(force.name for force in forces) or "no force"))
    linker.emit(pointers())
    linker.emit("def number(context, at):\n    return number_at(at)", "intrinsic")
    for text in forces_text(linker, 0, forces, _number):
        linker.emit(text, "inlined")
    for name, (taken, _) in functions_of(forces).items():
        given = [one if one in taken.split(", ") else "None" for one in _given(name).split(", ")]
        linker.emit(f"def {name}_at({taken}, p):\n    return {name}({', '.join(given)}, p)", "compiled")
    return "\n\n".join(linker.text) + "\n"


def _number(place: int, several: int | None) -> str:
    if several is not None:
        return tuple_of([_number(place + k, None) for k in range(several)])
    return f"number(p[{FIRST}] + {place} * p[{FIRST + 1}])"


def _lanes(modes: int, first: int) -> list[str]:
    """Return the functions of lanes as ``codegen`` does, for any number of tones; the laws' numbers begin at a place of `p`."""
    tones = "\n".join(
        f"    u{n} = 0.0\n    for k in range(waves.shape[0]):\n        u{n} += amplitudes[k * {modes} + {n}, j] * waves[k, i]"
        for n in range(modes)
    )
    drive = tuple_of([f"u{n}" for n in range(modes)])
    mine = [f"table[{k}, j]" for k in range(first)]
    laws = [f"table.ctypes.data + ({first} * table.shape[1] + j) * 8", "table.shape[1] * 8"]
    laws += [f"np.int64(table[table.shape[0] - {k}, j])" for k in (5, 4, 3, 2, 1)]
    numbers = [f"p[{k}]" for k in range(OTHERS)] + [f"others[{k - OTHERS}]" for k in range(OTHERS, first)]
    whole = [f"others.ctypes.data + {8 * (first - OTHERS)}", "np.int64(8)"]
    whole += [f"np.int64(others[others.shape[0] - {k}])" for k in (5, 4, 3, 2, 1)]
    return [
        f"def parameters_of(table, j):\n    return {tuple_of([*mine, *laws])}",
        "def waves_at(waves, i):\n    return waves, i",
        f"def lane_drive(amplitudes, j, c):\n    waves, i = c\n{tones}\n    return {drive}",
        f"def unpacked(tip):\n    p, others = tip, tip[{OTHERS}]\n    return {tuple_of([*numbers, *whole])}",
    ]
