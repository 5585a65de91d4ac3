"""Links plain Python functions, as source text, into one self-contained module.

Compiled code that lies on disk must not outlive a change of any function that went into it. So everything that goes into a
kernel is copied into one text, and the text's hash is its name.
"""

from __future__ import annotations

import ast
import builtins
import copy
import functools
import inspect
import math
import textwrap
from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any, TypeVar

import numpy as np

from dforce.core.arrays import AnyArray
from dforce.core.errors import ForceError
from dforce.core.syntax import expression_tree, is_as_loaded, syntax_tree
from dforce.kernel import vocabulary
from dforce.kernel.specialize import fold

Function = TypeVar("Function", bound=Callable[..., Any])
Sizes = tuple[tuple[str, int], ...]

# the composed module's own names
RESERVED = {
    "math",
    "np",
    "njit",
    "compiled",
    "apart",
    "inlined",
    "reordered",
    "uncounted",
    "entry",
    "unshared",
    "INNER",
    "OPTIONS",
    "carray",
    "pointer",
}


# annotations of a function that returns no array
SCALARS = ("None", "float", "int", "bool")
UFUNCS = ("np.log", "np.sin", "np.cos", "np.exp", "np.sqrt", "np.int64", "np.bool_", "np.float64")


class Linker:
    """Collects functions and their callees; each is emitted once, callees first."""

    def __init__(
        self,
        sizes: Mapping[str, int] | None = None,
        elsewhere: Mapping[Callable[..., Any], tuple[int, str]] | None = None,
    ) -> None:
        """`sizes` are numbers for functions without arguments, known while the text is made.

        `elsewhere` are functions of another module, with the place of their address in `p` and their types.
        """
        self._sizes = tuple((sizes or {}).items())
        self._elsewhere = elsewhere or {}
        self._names: dict[Callable[..., Any], str] = {}
        self._tables: dict[str, str] = {}
        self._taken: set[str] = set(vars(vocabulary)) | RESERVED
        self.text: list[str] = []

    def add(self, function: Callable[..., Any], name: str | None = None, decorator: str = "") -> str:
        """Add a function and its callees; return its name in the text.

        `decorator` is the name in the composed module of the way to compile it; left out: as a callee.

        Raises :class:`ForceError` when it uses something that cannot be copied: only numbers, tuples and arrays of numbers,
        functions of `math` and functions with Python source may be used.
        """
        if function in self._names:
            return self._names[function]
        _read(function, self._sizes)  # or it is refused
        wanted = name or f"{function.__module__.rsplit('.', 1)[-1]}_{function.__qualname__}".replace(".", "_")
        chosen = wanted if wanted not in self._taken else f"{wanted}_{len(self._taken)}"
        self._taken.add(chosen)
        self._names[function] = chosen
        if function in self._elsewhere:
            self._call(function, chosen)
        else:
            decorator = decorator or decorator_of(function)
            self.emit(self._copy(function, chosen, decorator), decorator)
        return chosen

    def _call(self, function: Callable[..., Any], name: str) -> None:
        """Add a function that calls one elsewhere by its address: in place, for a call on the way would count references."""
        place, types = self._elsewhere[function]
        names = arguments_of(function)
        given = ", ".join(names)
        returned = f"call_by_address({types!r}, {names.index('tip')}, {place}, {given})"
        self.emit(f"def {name}(context, {given}):\n    return {returned}", "intrinsic")

    def _copy(self, function: Callable[..., Any], name: str, decorator: str) -> str:
        """Return the text of a function under this name, after adding all that it calls."""
        own, (_, names) = inspect.unwrap(function).__globals__, _read(function, self._sizes)
        replaced = tuple(
            (used, self._resolve(own, used, function.__qualname__))
            for used in names
            if used in own or used not in vars(builtins)
        )
        # laws stay as they are: x**n with a literal n is a product
        return _text(function, self._sizes, name, replaced, decorator != "inlined")

    def add_entry(self, function: Callable[..., Any], name: str) -> None:
        """Add a function that is called from outside under this name: from Python, or by its address.

        A function that is already a callee of others is wrapped; else it is compiled only as the entry.
        """
        if signature_of(function):
            head, _, body = self._copy(function, name, "compiled").partition("\n")
            self.emit(f"{head}\n{body}", decorator_of(function))
            return
        if function not in self._names:
            self.add(function, name, "entry")
            return
        inner = self._names[function]
        arguments = ", ".join(arguments_of(function))
        self.emit(f"def {name}({arguments}):\n    return {inner}({arguments})", "entry")

    def emit(self, text: str, decorator: str = "") -> None:
        """Add text to the module, as a function if a decorator is passed."""
        self.text.append(f"@{decorator}\n{text}" if decorator else text)

    def _resolve(self, own: dict[str, Any], used: str, user: str) -> str:
        """Return the text for a name that a function reads from its file."""
        if used not in own:
            raise ForceError(f"'{user}' uses '{used}', which is not defined")
        value = own[used]
        literal = _literal(value)
        if literal is not None:
            return literal
        if value is math or value is np:
            return "math" if value is math else "np"
        if getattr(value, "__module__", None) == vocabulary.__name__:
            return str(value.__name__)
        if isinstance(value, np.ndarray):
            return self._table(value, used, user)
        if inspect.isbuiltin(value) and value.__module__ == "math":
            return f"math.{value.__name__}"
        if isinstance(value, FunctionType):
            return self.add(value)
        raise ForceError(
            f"'{user}' uses '{used}', a {type(value).__name__}; a law may use only numbers, "
            "arrays of numbers, functions of math and functions of its own file"
        )

    def _table(self, values: AnyArray, used: str, user: str) -> str:
        """Add an array of numbers; return its name in the text."""
        if values.dtype.kind not in "fi" or not np.isfinite(values).all():
            raise ForceError(f"'{user}' uses '{used}', an array that holds something other than finite numbers")
        text = f"np.array({values.tolist()}, np.{values.dtype})"
        if text not in self._tables:
            self._tables[text] = f"{used}_{len(self._taken)}" if used in self._taken else used
            self._taken.add(self._tables[text])
            self.emit(f"{self._tables[text]} = {text}")
        return self._tables[text]


def arguments_of(function: Callable[..., Any]) -> tuple[str, ...]:
    """Return the names of a function's arguments."""
    return function.__code__.co_varnames[: function.__code__.co_argcount]


def _mark(name: str) -> Callable[[Function], Function]:
    """Return a decorator that marks a function for the way in which it is compiled."""

    def mark(function: Function) -> Function:
        setattr(function, name, True)
        return function

    return mark


inlined = _mark("inlined")
"""Marks a function that must not stay a call, as only a loop without calls becomes vector instructions; it is `uncounted`."""
reordered = _mark("reordered")
"""Marks a function whose sums may be taken in any order: only so do they become vector instructions."""
uncounted = _mark("uncounted")
"""Marks a function that makes no array and returns none, where its annotation does not show it.

Its callers hold the arrays among its arguments: counting references to them is not necessary, and costs more than a step.
"""
apart = _mark("apart")
"""Marks a function called by its address that is `uncounted`, and whose arrays share no memory: no loop checks that."""


def by_address(signature: str) -> Callable[[Function], Function]:
    """Mark a function that is compiled for each tip equation; its callers use its address and are compiled once for all.

    `signature` has numba's types of the result and the arguments, with the motion as {y} and the tip equation as {tip}:
    `unpacked` makes `p` from this argument `tip`.
    """

    def mark(function: Function) -> Function:
        function.signature = signature  # type: ignore[attr-defined]
        return function

    return mark


def signature_of(function: Callable[..., Any]) -> str:
    """Return the signature of a function that is called by its address, or nothing."""
    return str(getattr(function, "signature", ""))


def decorator_of(function: Callable[..., Any]) -> str:
    """Return how a function is compiled: laws and functions marked for it are inlined."""
    for name in ("apart", "reordered", "uncounted"):
        if getattr(function, name, False):
            return name
    if getattr(function, "inlined", False) or function.__module__.startswith("dforce.forces"):
        return "inlined"
    return "compiled" if may_hold_arrays(function) else "uncounted"


def may_hold_arrays(function: Callable[..., Any]) -> bool:
    """Return whether a function may make or return an array, by its text.

    Annotations of functions from elsewhere do not count: a wrong annotation would free numbers in use.
    """
    if not function.__module__.startswith("dforce.") or function.__annotations__.get("return") not in SCALARS:
        return True
    for node in ast.walk(parse_function(function)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            maker = ast.unparse(node.func)
            if (maker.startswith("np.") and maker not in UFUNCS) or maker.endswith(".copy"):
                return True
    return False


def parse_function(function: Callable[..., Any]) -> ast.FunctionDef:
    """Return the function's syntax tree without decorators, annotations and docstring."""
    try:
        source = textwrap.dedent(inspect.getsource(function))
    except (OSError, TypeError):
        raise ForceError(f"the source of '{function.__qualname__}' cannot be read; define it in a file") from None
    nodes = list(ast.walk(syntax_tree(source)))
    if not function.__module__.startswith("dforce.") and not is_as_loaded(function):
        name = function.__qualname__
        raise ForceError(f"the file of '{name}' has changed since Python read it; load it again, or restart Python")
    found = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    if not found or any(isinstance(node, ast.Lambda | ast.Nonlocal | ast.Global) for node in nodes):
        raise ForceError(f"'{function.__qualname__}' must be a plain function without lambda, global or nonlocal")
    node = found[0]
    if len(found) > 1:
        raise ForceError(f"'{function.__qualname__}' must not define functions inside")
    node.decorator_list = []
    node.returns = None
    for argument in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs):
        argument.annotation = None
    for inner in nodes:
        for name in ("body", "orelse", "finalbody"):
            block = getattr(inner, name, None)
            if isinstance(block, list):
                setattr(inner, name, [_without_annotation(statement) for statement in block])
    if ast.get_docstring(node) is not None:
        node.body = node.body[1:] or [ast.Pass()]
    return node


def _without_annotation(item: Any) -> Any:
    if isinstance(item, ast.AnnAssign) and item.value is not None:
        return ast.copy_location(ast.Assign([item.target], item.value), item)
    return item


def global_names(node: ast.FunctionDef) -> set[str]:
    """Return the names that a function reads from outside itself."""
    nodes = list(ast.walk(node))
    local = {argument.arg for argument in nodes if isinstance(argument, ast.arg)}
    names = [inner for inner in nodes if isinstance(inner, ast.Name)]
    local |= {name.id for name in names if isinstance(name.ctx, ast.Store)}
    return {name.id for name in names if isinstance(name.ctx, ast.Load)} - local


# most kernels share most of their functions
@functools.lru_cache(maxsize=1024)
def _read(function: Callable[..., Any], sizes: Sizes) -> tuple[ast.FunctionDef, list[str]]:
    """Return the syntax tree of a function, without branches that these sizes leave unused, and the names that it reads."""
    tree = fold(parse_function(function), dict(sizes))
    return tree, sorted(global_names(tree))


@functools.lru_cache(maxsize=4096)
def _text(
    function: Callable[..., Any], sizes: Sizes, name: str, replaced: tuple[tuple[str, str], ...], plain: bool
) -> str:
    """Return a function under this name, with these texts in the place of names from outside."""
    tree = _Renamer(dict(replaced)).visit(copy.deepcopy(_read(function, sizes)[0]))
    tree.name = name
    return ast.unparse(ast.fix_missing_locations(_Plainer().visit(tree) if plain else tree))


_expression = functools.lru_cache(maxsize=4096)(expression_tree)


class _Renamer(ast.NodeTransformer):
    def __init__(self, replacements: dict[str, str]) -> None:
        self.replacements = {used: _expression(text) for used, text in replacements.items()}

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if isinstance(node.ctx, ast.Load) and node.id in self.replacements:
            return self.replacements[node.id]
        return node


class _Plainer(ast.NodeTransformer):
    """Removes literal types, so that numba does not compile a function again for each constant.

    To numba each literal 0, 1, or False has its own type, and a function is compiled anew for each such argument.
    """

    def visit_Assign(self, node: ast.Assign) -> ast.Assign:
        self.generic_visit(node)
        if isinstance(node.value, ast.Tuple) and isinstance(node.targets[0], ast.Tuple):
            # a new one: other functions have the same one, too
            node.value = ast.Tuple([self._plain(value) for value in node.value.elts], node.value.ctx)
        else:
            node.value = self._plain(node.value)
        return node

    def visit_Call(self, node: ast.Call) -> ast.Call:
        self.generic_visit(node)
        if isinstance(node.func, ast.Name) and node.func.id not in vars(builtins):
            node.args = [self._plain(value) for value in node.args]
        return node

    @staticmethod
    def _plain(value: ast.expr) -> ast.expr:
        if not isinstance(value, ast.Constant) or not isinstance(value.value, int):
            return value
        kind = "np.bool_" if isinstance(value.value, bool) else "np.int64"
        return _expression(f"{kind}({value.value})")


def _literal(value: Any) -> str | None:
    """Return a number, or a tuple of numbers, as source text; None for anything else."""
    if isinstance(value, bool | int | np.integer):
        return repr(value if isinstance(value, bool) else int(value))
    if isinstance(value, float | np.floating):
        number = float(value)
        return repr(number) if math.isfinite(number) else f"float('{number}')"
    if isinstance(value, tuple) and value:
        items = [_literal(item) for item in value]
        found = [item for item in items if item is not None]
        return f"({', '.join(found)},)" if len(found) == len(items) else None
    return None


@functools.lru_cache(maxsize=64)
def compile_function(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return one law compiled as in a kernel: linked as text with all that it calls."""
    from dforce.kernel.cache import check_compiler

    check_compiler()
    import numba

    linker = Linker()
    name = linker.add(function, function.__name__)
    jit = numba.njit(error_model="numpy")
    module: dict[str, Any] = {"compiled": jit, "inlined": jit, "reordered": jit, "math": math, "np": np}
    exec("\n\n".join(linker.text), module)
    compiled: Callable[..., Any] = module[name]
    return compiled
