"""Force laws as compiled functions over several points, called by address.

Each law is compiled alone, once, with its callees; its callers have its address and the place of its numbers.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
from numba.core import cgutils, sigutils, types
from numba.extending import intrinsic

from dforce.core.arrays import Array
from dforce.forces import Force
from dforce.kernel import Kernel, cache, texts
from dforce.kernel.codegen import HEADER, calls_of, tuple_of
from dforce.kernel.linker import Linker

TYPES = "void(i8,voidptr,voidptr,voidptr,voidptr,f8,f8,voidptr,voidptr)"
KINDS = ("law", "evolve", "switch")
OVER_POINTS = """
def {name}_over_points(count, distances, rates, times, memories, latched, zc, given, results):
    d, rate, t = carray(distances, count, np.float64), carray(rates, count, np.float64), carray(times, count, np.float64)
    numbers, memory = carray(given, {numbers}, np.float64), carray(memories, (count, {memory}), np.float64)
    out = carray(results, {shape}, np.float64)
    for i in range(count):
        {call}
"""


class Laws(NamedTuple):
    """The laws of a sum of forces.

    Attributes
    ----------
    address
        Address of each law, of the function that evolves its memory, and of its switch (0 where there is none), (forces, 3).
    place
        For each force: its first number behind the lever's numbers, its first state of memory, its number of states, its
        latch (-1 where there is none), (forces, 4).
    rate
        Whether any law may depend on the rate of the distance, on memory or on branches.
    """

    address: Any
    place: Any
    rate: bool


def text_of(force: Force) -> str:
    """Return the text of a module with the law of one force over points."""
    linker = Linker()
    linker.emit(HEADER.format(contents=force.name) + "from numba import carray")
    results = {"law": "out[i] += ", "evolve": "", "switch": "out[i] = "}
    states = "memory[i]", "out[i]", "latched", "zc"
    for name, call in calls_of(force, linker, "d[i], rate[i], t[i]", states, 0, _number):
        shape = f"(count, {force.memory})" if name == "evolve" else "count"
        sizes = {"numbers": len(force.numbers()), "memory": force.memory, "shape": shape}
        linker.emit(OVER_POINTS.format(name=name, call=results[name] + call, **sizes).strip(), "compiled")
    return "\n\n".join(linker.text) + "\n"


def _number(place: int, several: int | None) -> str:
    """Return the text of numbers of a law; see :data:`dforce.kernel.codegen.Number`."""
    return f"numbers[{place}]" if several is None else tuple_of([f"numbers[{place + k}]" for k in range(several)])


@functools.lru_cache(maxsize=256)
def _kernel(text: str, name: str) -> Kernel:
    return Kernel(cache.load(text), f"the law of {name}")


def laws_of(forces: Sequence[Force]) -> Laws:
    """Return the laws of forces, compiled."""
    address, place = np.zeros((len(forces), 3), np.int64), np.zeros((len(forces), 4), np.int64)
    numbers, states, latches = 0, 0, 0
    for i, force in enumerate(forces):
        parts = ("engine law", force.memory, force.layout())
        kernel = _kernel(texts.remembered(parts, [force], functools.partial(text_of, force)), force.name)
        has_latch = force.switch is not None
        names = ["law", *(["evolve"] if force.evolve is not None else []), *(["switch"] if has_latch else [])]
        for name in names:
            address[i, KINDS.index(name)] = kernel.address(f"{name}_over_points", TYPES)
        place[i] = numbers, states, force.memory, latches if has_latch else -1
        numbers, states, latches = numbers + len(force.numbers()), states + force.memory, latches + has_latch
    return Laws(address, place, not all(force.is_of_distance_alone for force in forces))


def _call_over_points(context: Any, address: Any, given: Any) -> Any:
    """Call a compiled function over points with the arguments of `TYPES`; arrays are passed by address."""
    arguments, result = sigutils.normalize_signature(TYPES)  # type: ignore[no-untyped-call]

    def generate(target: Any, builder: Any, typed: Any, values: Any) -> Any:
        kind = target.call_conv.get_function_type(result, arguments)
        function = builder.inttoptr(values[0], kind.as_pointer())
        pointer = target.get_value_type(types.voidptr)
        passed = [
            builder.inttoptr(value, pointer) if kind == types.voidptr else value
            for kind, value in zip(arguments, cgutils.unpack_tuple(builder, values[1]), strict=True)  # type: ignore[no-untyped-call]
        ]
        target.call_conv.call_function(builder, function, result, arguments, passed)
        return target.get_dummy_value()

    return result(address, given), generate


call_over_points: Callable[..., None] = intrinsic(_call_over_points)


@numba.njit(nogil=True)
def add_laws(address: Any, place: Any, zc: float, numbers: Any, d: Any, rate: Any, out: Any) -> None:
    """Add the forces (N) at distances (m) and rates (m/s) at time zero to `out`; no law has a memory or branches."""
    at_rest = np.zeros(d.shape[0])
    for f in range(address.shape[0]):
        motion = d.ctypes.data, rate.ctypes.data, at_rest.ctypes.data
        call_over_points(
            address[f, 0], (d.shape[0], *motion, 0, 0.0, zc, numbers.ctypes.data + 8 * place[f, 0], out.ctypes.data)
        )


def force_over(laws: Laws, numbers: Array, zc: float, d: Array, rate: Array) -> Array:
    """Return the force (N) at points of a motion about an average distance `zc` (m), of the shape of `d`.

    Parameters
    ----------
    laws, numbers
        Laws without memory, branches or explicit time, and their numbers one behind the other.
    d, rate
        Distances (m) and their rates of change (m/s), contiguous.
    """
    out = np.zeros(d.size)
    compiled = entry("add_laws", "the sum of force laws", ("laws",))
    compiled(laws.address, laws.place, float(zc), numbers, d.ravel(), rate.ravel(), out)
    return out.reshape(d.shape)


@functools.cache
def entry(name: str, title: str, sources: tuple[str, ...]) -> Callable[..., None]:
    """Return a function of the last of some files of this folder; its first call compiles it or loads it from the user's disk.

    The hash of all these files names its module: the code lasts until one of them changes.
    """
    texts = [Path(__file__).with_name(f"{source}.py").read_bytes() for source in sources]
    stamp = hashlib.sha256(b"\0".join(texts)).hexdigest()
    kernel: Any = Kernel(cache.load(f"# {stamp}\n{texts[-1].decode()}"), title)
    return kernel.entry(name)  # type: ignore[no-any-return]
