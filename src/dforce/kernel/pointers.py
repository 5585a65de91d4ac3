"""Calls of compiled functions, and numbers, by their address; this text is copied into the modules that need it."""

from typing import Any

from numba import carray  # type: ignore[attr-defined]  # noqa: F401
from numba.core import cgutils, sigutils, types
from numba.core.errors import TypingError
from numba.extending import intrinsic  # noqa: F401


def call_by_address(kinds: str, tip: int, place: int, *given: Any) -> Any:
    """Return typing and code generation of an intrinsic that calls a function pointer.

    The pointer is element `place` of argument number `tip`, a tuple.
    """
    arguments, result = sigutils.normalize_signature(kinds)  # type: ignore[no-untyped-call]
    if given != arguments:  # or it would read its arguments where there are none
        raise TypingError(f"called with {given}, not with {arguments}")

    def generate(target: Any, builder: Any, typed: Any, values: Any) -> Any:
        kind = target.call_conv.get_function_type(result, arguments)
        function = builder.inttoptr(builder.extract_value(values[tip], place), kind.as_pointer())
        status, found = target.call_conv.call_function(builder, function, result, arguments, values)
        with cgutils.if_unlikely(builder, status.is_error):  # type: ignore[no-untyped-call]
            target.call_conv.return_status_propagate(builder, status)
        return found

    return result(*given), generate


def pointer_to(at: Any) -> Any:
    """Return typing and code generation of an intrinsic that makes a pointer of an address."""

    def generate(target: Any, builder: Any, typed: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], target.get_value_type(types.voidptr))

    return types.voidptr(at), generate


def number_at(at: Any) -> Any:
    """Return typing and code generation of an intrinsic that reads a number in memory."""

    def generate(target: Any, builder: Any, typed: Any, values: Any) -> Any:
        kind = target.get_value_type(types.float64)
        return builder.load(builder.inttoptr(values[0], kind.as_pointer()))

    return types.float64(at), generate
