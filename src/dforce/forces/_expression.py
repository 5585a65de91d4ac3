"""Expressions of users, read as data: checked, and rewritten as the text of a law.

The user's text is parsed, never run. Each node of its syntax tree must be of a known kind. A new tree is built, of known names
and plain numbers only, and its text is the law that runs and is compiled.

Parts that do not depend on the motion are computed once a run: ``P3*sqrt(R)*indentation**1.5`` costs a step one product and
the power. A division by zero or the logarithm of a negative number gives infinity or NaN, interpreted as well as compiled.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import linecache
import math
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from dforce.core.errors import ParameterError, nearest, shorten
from dforce.core.syntax import expression_tree
from dforce.forces._exponential import exponential

MOTION = {"d": "d", "z": "z", "indentation": "indentation", "velocity": "rate", "t": "t"}
PARAMETERS = ("R", "H", "a0", "E_eff", "k", "Q", "P1", "P2", "P3", "P4")
FUNCTIONS = {
    "abs": "abs",
    "exp": "exp",
    "log": "log",
    "log10": "log10",
    "sqrt": "sqrt",
    "sign": "sign",
    "sin": "sin",
    "cos": "cos",
    "tan": "tan",
    "asin": "arcsin",
    "acos": "arccos",
    "atan": "arctan",
    "sinh": "sinh",
    "cosh": "cosh",
    "tanh": "tanh",
}
EXTREMES = {"min": "minimum", "max": "maximum"}
CONSTANTS = {"pi": math.pi}
NAMES = (*MOTION, *PARAMETERS, *FUNCTIONS, *EXTREMES, "where", *CONSTANTS)

LONGEST = 2000  # characters
MOST_NODES = 400  # a law compiles within seconds
DEEPEST = 60  # levels: Python's own writer of expressions is recursive
WHOLE = 64  # powers up to this are products, beyond it the general power

OPERATORS: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.true_divide,
    ast.Pow: np.power,
}
COMPARISONS = (ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq)
REFUSED: dict[type[ast.expr], str] = {
    ast.Attribute: "an attribute",
    ast.Lambda: "a lambda",
    ast.Subscript: "an index",
    ast.JoinedStr: "text",
    **dict.fromkeys((ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp), "a comprehension"),
    ast.NamedExpr: "an assignment",
    ast.Starred: "a star",
    **dict.fromkeys((ast.List, ast.Tuple), "a list"),
    ast.Dict: "a dictionary",
    ast.Set: "a set",
}

POINT = "write decimals with a point, such as 0.5"
DECIMAL = re.compile(r"(?<![\w.])\d+,\d+")  # of min and max, which take any number of arguments
TYPESET = str.maketrans({"−": "-", "·": "*", "×": "*", "²": "**2", "³": "**3"})


@dataclass(frozen=True)
class Expression:
    """A checked expression.

    Attributes
    ----------
    variables
        The names of :data:`MOTION` and :data:`PARAMETERS` that it depends on; the indentation also needs a0.
    function
        The law: ``function(d, rate, t, *constants)``, with `zc` after `t` where it depends on `z`.
    prepare
        From the parameters by name: the constants, and the distances (m) at which a comparison with d turns.
    meanings
        For each constant, its part of the expression.
    """

    variables: frozenset[str]
    function: Callable[..., float]
    prepare: Callable[[Mapping[str, float]], tuple[tuple[float, ...], tuple[float, ...]]]
    meanings: tuple[str, ...]


@functools.lru_cache(maxsize=256)
def read(text: str) -> Expression:
    """Return the expression that a text holds.

    Raises
    ------
    ParameterError
        For everything that is not an expression of known names, numbers, operators and functions.
    """
    try:
        return _built(_parsed(text))
    except (RecursionError, SyntaxError):  # the rewritten text has more parentheses than the user's
        raise ParameterError("is nested too deeply") from None


def _built(tree: ast.expr) -> Expression:
    builder = _Builder()
    body = builder.placed(builder.number(tree))
    variables = frozenset(builder.variables)
    lines = []
    if "z" in variables:
        lines.append("z = d - zc")
    if "indentation" in variables:
        a0 = ast.unparse(builder.placed(_name("a0")))
        lines.append(f"indentation = np.maximum({a0} - d, 0.0)")
    constants = [f"c{i}" for i in range(len(builder.constants))]
    lines.append(f"return {ast.unparse(body)}")
    function = _function("law", ["d", "rate", "t", *["zc"] * ("z" in variables), *constants], lines)

    used = [name for name in PARAMETERS if name in builder.variables]
    rows = [", ".join(map(ast.unparse, row)) for row in (builder.constants.values(), builder.edges)]
    result = "return " + ", ".join(f"({row},)" if row else "()" for row in rows)
    inner = _function("prepare", used, [result], tuple)

    def prepare(values: Mapping[str, float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        constants, edges = inner(*(values[name] for name in used))
        return tuple(map(float, constants)), tuple(map(float, edges))

    return Expression(variables, function, prepare, tuple(builder.constants))


def _parsed(text: str) -> ast.expr:
    if len(text) > LONGEST:
        raise ParameterError(f"has {len(text)} characters; the limit is {LONGEST}")
    if not text.strip():
        raise ParameterError("is empty; write a force in N, such as -P1*exp(-d/P2)")
    for sign, advice in (("#", "an expression has no comments"), ("^", "write ** for a power")):
        if sign in text:
            raise ParameterError(f"has a '{sign}'; {advice}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Python has advice on style
            tree = expression_tree(" ".join(text.split()).translate(TYPESET))
    except SyntaxError as error:
        if re.search(r"(?<![<>=!:])=(?!=)", text):
            raise ParameterError("has an '='; write only the right side of the equation") from None
        place = f" at character {error.offset}" if error.offset else ""
        raise ParameterError(f"is not an expression: {error.msg.split('.')[0]}{place}") from None
    except (ValueError, RecursionError, MemoryError):
        raise ParameterError("is not an expression, or is nested too deeply") from None
    level, nodes, depth = [tree], 0, 0
    while level:
        nodes, depth = nodes + len(level), depth + 1
        if nodes > MOST_NODES:
            raise ParameterError(f"has more than {MOST_NODES} numbers, names and operations")
        if depth > DEEPEST:
            raise ParameterError(f"is nested more than {DEEPEST} levels deep")
        level = [part for node in level for part in ast.iter_child_nodes(node) if isinstance(part, ast.expr)]
    return tree


def _function(
    name: str, arguments: Sequence[str], lines: Sequence[str], result: Callable[[Any], Any] = float
) -> Callable[..., Any]:
    """Return a function made of text written here; its source lies where the kernel's linker looks."""
    source = f"def {name}({', '.join(arguments)}):\n" + "".join(f"    {line}\n" for line in lines)
    file = f"<custom law {hashlib.sha256(source.encode()).hexdigest()[:20]}>"
    linecache.cache[file] = (len(source), None, source.splitlines(keepends=True), file)
    space: dict[str, Any] = {"np": np, "exponential": exponential}
    space |= {"__name__": "dforce.forces.custom", "__builtins__": {"abs": abs}}
    exec(compile(source, file, "exec"), space)
    inner = space[name]

    @functools.wraps(inner)
    def plain(*numbers: float) -> Any:
        with np.errstate(all="ignore"):  # NumPy's numbers divide by zero as compiled ones do
            return result(inner(*map(np.float64, numbers)))

    return plain


@dataclass(frozen=True)
class _Term:
    """A part of the expression, built anew; whether the motion changes it; its value if it is a number."""

    tree: ast.expr
    moving: bool = False
    value: float | None = None


def _name(name: str) -> _Term:
    return _Term(ast.Name(MOTION.get(name, name), ast.Load()), name in MOTION)


def _numpy(name: str, *arguments: ast.expr) -> ast.expr:
    function = ast.Attribute(ast.Name("np", ast.Load()), name, ast.Load())
    own = {"abs": "abs", "exp": "exponential"}.get(name)
    return ast.Call(ast.Name(own, ast.Load()) if own else function, list(arguments), [])


def _shown(node: ast.expr) -> str:
    return shorten(ast.unparse(node), 60)


class _Builder:
    """Builds the new tree, and collects the arguments of the law."""

    def __init__(self) -> None:
        self.variables: set[str] = set()
        self.constants: dict[str, ast.expr] = {}
        self.edges: list[ast.expr] = []

    def placed(self, term: _Term) -> ast.expr:
        """Return a term for use in the law: a term that does not depend on the motion becomes an argument."""
        if term.moving or term.value is not None:
            return term.tree
        self.constants.setdefault(ast.unparse(term.tree), term.tree)
        return ast.Name(f"c{list(self.constants).index(ast.unparse(term.tree))}", ast.Load())

    def joined(
        self, node: ast.expr, terms: Sequence[_Term], make: Callable[..., ast.expr], compute: Callable[..., Any]
    ) -> _Term:
        """Return an operation on terms; one on numbers alone is done at once."""
        values = [term.value for term in terms]
        if None not in values:
            with np.errstate(all="ignore"):
                return _number(node, float(compute(*map(np.float64, values))))
        if any(term.moving for term in terms):
            return _Term(make(*map(self.placed, terms)), moving=True)
        return _Term(make(*(term.tree for term in terms)))

    def number(self, node: ast.expr) -> _Term:
        """Return the term of a node for a number."""
        match node:
            case ast.Constant():
                return _constant(node)
            case ast.Name():
                return self._variable(node)
            case ast.UnaryOp(op=ast.UAdd()):
                return self.number(node.operand)
            case ast.UnaryOp(op=ast.USub()):
                return self.joined(node, [self.number(node.operand)], lambda x: ast.UnaryOp(ast.USub(), x), np.negative)
            case ast.BinOp() if type(node.op) in OPERATORS:
                return self._operation(node)
            case ast.IfExp():
                return self._choice(node.test, node.body, node.orelse)
            case ast.Call():
                return self._call(node)
            case ast.Compare() | ast.BoolOp() | ast.UnaryOp(op=ast.Not()):
                raise ParameterError(
                    f"has the condition '{_shown(node)}' in place of a number; write where(condition, x, y)"
                )
        raise _refusal(node)

    def condition(self, node: ast.expr) -> ast.expr:
        """Return the tree of a node for a condition."""
        match node:
            case ast.Compare() if all(isinstance(operator, COMPARISONS) for operator in node.ops):
                terms = [self.number(part) for part in (node.left, *node.comparators)]
                for pair in pairwise(terms):
                    self._note_edge(*pair)
                    self._note_edge(*reversed(pair))
                first, *others = map(self.placed, terms)
                return ast.Compare(first, node.ops, others)
            case ast.BoolOp():
                return ast.BoolOp(node.op, [self.condition(part) for part in node.values])
            case ast.UnaryOp(op=ast.Not()):
                return ast.UnaryOp(node.op, self.condition(node.operand))
        raise ParameterError(f"has '{_shown(node)}' in place of a condition such as d < a0")

    def _note_edge(self, one: _Term, other: _Term) -> None:
        """Keep the distance at which d, or the indentation, passes the other side of a comparison."""
        if other.moving or not isinstance(one.tree, ast.Name):
            return
        if one.tree.id == "d":
            self.edges.append(other.tree)
        elif one.tree.id == "indentation":
            self.edges.append(ast.BinOp(_name("a0").tree, ast.Sub(), other.tree))

    def _variable(self, node: ast.Name) -> _Term:
        name = node.id
        if name in CONSTANTS:
            return _number(node, CONSTANTS[name])
        if name in MOTION or name in PARAMETERS:
            self.variables.add(name)
            if name == "indentation":
                self.variables.add("a0")
            return _name(name)
        if name in NAMES:
            raise ParameterError(f"has the function '{name}' without its arguments; write {name}(...)")
        known = (*MOTION, *PARAMETERS, *CONSTANTS)
        raise ParameterError(f"has the unknown name '{shorten(name, 40)}'{nearest(name[:100], known)}")

    def _operation(self, node: ast.BinOp) -> _Term:
        terms = [self.number(node.left), self.number(node.right)]
        compute = OPERATORS[type(node.op)]
        exponent = terms[1].value
        if isinstance(node.op, ast.Pow) and exponent is not None:
            return self.joined(node, terms[:1], lambda x: _power(x, exponent), lambda x: compute(x, exponent))
        return self.joined(node, terms, lambda x, y: ast.BinOp(x, node.op, y), compute)

    def _choice(self, test: ast.expr, body: ast.expr, other: ast.expr) -> _Term:
        condition = self.condition(test)
        first, second = (
            # a plain number in the place of NumPy's could not be divided by when it is zero
            _numpy("float64", term.tree) if term.value is not None else self.placed(term)
            for term in (self.number(body), self.number(other))
        )
        return _Term(ast.IfExp(condition, first, second), moving=True)

    def _call(self, node: ast.Call) -> _Term:
        if not isinstance(node.func, ast.Name):
            raise _refusal(node.func)
        name, count = node.func.id, len(node.args)
        if node.keywords or any(isinstance(argument, ast.Starred) for argument in node.args):
            raise ParameterError(f"has {shorten(name, 40)} with arguments that are not plain")
        if name == "where":
            _check_count(name, count, 3)
            return self._choice(*node.args)
        if name in FUNCTIONS:
            _check_count(name, count, 1)
            compute = getattr(np, FUNCTIONS[name])
            return self.joined(node, [self.number(node.args[0])], lambda x: _numpy(FUNCTIONS[name], x), compute)
        if name in EXTREMES:
            if count < 2:
                raise ParameterError(f"has {name} with fewer than two arguments")
            for one, other in pairwise(node.args if count > 2 else ()):
                found = DECIMAL.search(f"{ast.unparse(one)},{ast.unparse(other)}")
                if found and other.col_offset - 1 == one.end_col_offset:
                    raise ParameterError(f"has '{found[0]}' in {name}; {POINT}, and a space after other commas")
            return self._extreme(node, EXTREMES[name])
        if name in NAMES:
            raise ParameterError(f"has '{_shown(node)}', but {name} is a number and not a function")
        hint = nearest(name[:100], (*FUNCTIONS, *EXTREMES, "where"))
        raise ParameterError(f"has the unknown function '{shorten(name, 40)}'{hint}")

    def _extreme(self, node: ast.Call, name: str) -> _Term:
        terms = [self.number(argument) for argument in node.args]
        while len(terms) > 1:  # in pairs, so that many arguments are not nested deeply
            pairs = [terms[i : i + 2] for i in range(0, len(terms) - 1, 2)]
            made = [self.joined(node, pair, lambda x, y: _numpy(name, x, y), getattr(np, name)) for pair in pairs]
            terms = made + terms[2 * len(pairs) :]
        return terms[0]


def _number(node: ast.expr, value: float) -> _Term:
    if not math.isfinite(value):
        raise ParameterError(f"has '{_shown(node)}', which is not a finite number")
    return _Term(ast.Constant(value), value=value)


def _constant(node: ast.Constant) -> _Term:
    if isinstance(node.value, bool) or not isinstance(node.value, int | float):
        kind = "the text" if isinstance(node.value, str | bytes) else "the value"
        raise ParameterError(f"has {kind} {shorten(repr(node.value), 40)}; only plain numbers are allowed")
    return _number(node, float(node.value) if abs(node.value) < 1e308 else math.inf)


def _power(base: ast.expr, exponent: float) -> ast.expr:
    """Return a power with a known exponent; whole and half ones are products and roots, which are quick."""
    if abs(exponent) > WHOLE or not (2.0 * exponent).is_integer():
        return ast.BinOp(base, ast.Pow(), ast.Constant(exponent))
    if exponent < 0.0:
        # written as a division: a compiled power with a negative whole exponent stops at a division by zero
        return ast.BinOp(ast.Constant(1.0), ast.Div(), _power(base, -exponent))
    if exponent == 0.5:
        return _numpy("sqrt", base)
    if exponent.is_integer():
        return ast.BinOp(base, ast.Pow(), ast.Constant(int(exponent)))
    return ast.BinOp(_numpy("sqrt", base), ast.Pow(), ast.Constant(int(2.0 * exponent)))


def _check_count(name: str, count: int, wanted: int) -> None:
    if count != wanted:
        advice = f"; {POINT}" if count > wanted else ""
        raise ParameterError(f"has {name} with the wrong number of arguments, {count} instead of {wanted}{advice}")


def _refusal(node: ast.expr) -> ParameterError:
    if isinstance(node, ast.BinOp | ast.UnaryOp):
        return ParameterError(f"has '{_shown(node)}'; the operators are + - * / ** and comparisons")
    if isinstance(node, ast.Tuple) and node.elts:
        return ParameterError(f"has a comma outside a function; {POINT}")
    form = REFUSED.get(type(node), "a form of Python")
    return ParameterError(f"has {form} ('{_shown(node)}'), not allowed in an expression")
