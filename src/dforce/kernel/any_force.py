"""The tip equation of any sum of forces, called by its address: slower than a combination's own, and compiled long before.

Beside the motion such a tip equation knows a force by three whole numbers: where the first number of its laws lies, how far
the next one is from it (bytes), and where its compiled function lies. That address is a number of the parameters, their last.
Only forces without memory and branches are called so; the text counts modes, states of the fluid, and whether there are roots.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from dforce.forces import Force
from dforce.kernel.codegen import HEADER, OTHERS, ZC, given_to, parameter_count, shared_text, sizes_of, tuple_of
from dforce.kernel.linker import Linker

LAWS = "Tuple((f8,i8,i8,i8))"  # the average distance, and the three numbers above
FORCE = f"f8(f8,f8,f8,{LAWS})"  # types of the function that is called: of distance, velocity, time and these


def is_callable(forces: Sequence[Force]) -> bool:
    """Say whether forces can be called by their address: those that are functions of motion and time."""
    return not any(force.memory or force.switch is not None for force in forces)


def compose_any(modes: int, late: int, rooted: bool, entries: dict[str, Callable[..., Any]]) -> str:
    """Return the text of a module with entry functions for any sum of forces, see ``codegen.compose``.

    `rooted` says whether one of the forces begins like a root.
    """
    sizes = sizes_of(modes, (), late) | {"root_count": int(rooted)}
    linker = Linker(sizes)
    linker.emit(HEADER.format(what=f"{modes} mode{'s' * (modes > 1)} and any force"))
    linker.emit(_pointers())
    called = "context, d, rate, t, p"
    linker.emit(f"def law_at({called}):\n    return call_by_address({FORCE!r}, 3, 3, d, rate, t, p)", "intrinsic")
    first = parameter_count(modes, late)
    laws = tuple_of([f"p[{ZC}]", *(f"p[{first + k}]" for k in range(3))])
    for text in (*shared_text(sizes, modes, late), *_lanes(modes, first)):
        linker.emit(text, "inlined")
    linker.emit(f"def force(d, rate, t, memory, latched, p):\n    return law_at(d, rate, t, {laws})", "inlined")
    linker.emit("def switch(which, latched, d, rate, t, p):\n    return -1.0", "inlined")
    for name, function in entries.items():
        linker.add_entry(function, name)
    return "\n\n".join(linker.text) + "\n"


def compose_laws(forces: Sequence[Force]) -> str:
    """Return the text of a module whose function `force` sums the laws, of the types :data:`FORCE`."""
    linker, terms, place = Linker(), [], 0
    linker.emit(HEADER.format(what=" + ".join(force.name for force in forces)))
    linker.emit(_pointers())
    linker.emit("def number(context, at):\n    return number_at(at)", "intrinsic")
    for force in forces:
        law = linker.add(force.law_function())
        given, place = given_to(force, place, _numbers)
        located = ["p[0]"] if "zc" in force.leading() else []
        terms.append(f"{law}({', '.join(['d', 'rate', 't', *located, *given])})")
    linker.emit(f"def force(d, rate, t, p):\n    return {' + '.join(terms) or '0.0'}", "compiled")
    return "\n\n".join(linker.text) + "\n"


def _numbers(place: int, several: int | None) -> str:
    if several is not None:
        return tuple_of([_numbers(place + k, None) for k in range(several)])
    return f"number(p[1] + {place} * p[2])"


def _pointers() -> str:
    return Path(__file__).with_name("pointers.py").read_text(encoding="utf-8")


def _lanes(modes: int, first: int) -> list[str]:
    """Return what ``codegen`` does for lanes, for any number of tones; the laws' numbers begin at a place of `p`."""
    tones = "\n".join(
        f"    u{n} = 0.0\n    for k in range(waves.shape[0]):\n        u{n} += amplitudes[k * {modes} + {n}, j] * waves[k, i]"
        for n in range(modes)
    )
    drive = tuple_of([f"u{n}" for n in range(modes)])
    mine = [f"table[{k}, j]" for k in range(first)]
    laws = f"table.ctypes.data + ({first} * table.shape[1] + j) * 8", "table.shape[1] * 8"
    address = "np.int64(table[table.shape[0] - 1, j])"
    numbers = [f"p[{k}]" for k in range(OTHERS)] + [f"others[{k - OTHERS}]" for k in range(OTHERS, first)]
    whole = [f"others.ctypes.data + {8 * (first - OTHERS)}", "np.int64(8)", "np.int64(others[others.shape[0] - 1])"]
    return [
        f"def parameters_of(table, j):\n    return {tuple_of([*mine, *laws, address])}",
        "def waves_at(waves, i):\n    return waves, i",
        f"def lane_drive(amplitudes, j, c):\n    waves, i = c\n{tones}\n    return {drive}",
        f"def whole(p):\n    others = p[{OTHERS}]\n    return {tuple_of([*numbers, *whole])}",
    ]
