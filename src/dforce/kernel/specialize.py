"""Removes unused code from a function: for memory or branches that no force of a combination has.

The compiler would remove it as well, but only after it has worked through it.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping


def fold(function: ast.FunctionDef, sizes: Mapping[str, int]) -> ast.FunctionDef:
    """Return the function with numbers in the place of calls of these names, without the branches that are not taken."""
    stored = [name.id for name in _names(function) if isinstance(name.ctx, ast.Store)]
    known = {}
    for node in ast.walk(function):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            target, size = node.targets[0].id, _called(node.value)
            if size in sizes and stored.count(target) == 1:
                known[target] = sizes[size]
    folded: ast.FunctionDef = _Folder(sizes, known).visit(function)
    return folded


def _names(function: ast.FunctionDef) -> Iterable[ast.Name]:
    return (node for node in ast.walk(function) if isinstance(node, ast.Name))


def _called(node: ast.expr) -> str:
    """Return the name of the called function, or nothing."""
    return node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""


class _Folder(ast.NodeTransformer):
    def __init__(self, sizes: Mapping[str, int], known: Mapping[str, int]) -> None:
        self.sizes, self.known = sizes, known

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        return ast.Constant(self.sizes[_called(node)]) if _called(node) in self.sizes else node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        known = isinstance(node.ctx, ast.Load) and node.id in self.known
        return ast.Constant(self.known[node.id]) if known else node

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        self.generic_visit(node)
        if not isinstance(node.test, ast.Constant):
            return node
        return node.body if node.test.value else node.orelse

    def visit_If(self, node: ast.If) -> ast.stmt | list[ast.stmt]:
        self.generic_visit(node)
        if not isinstance(node.test, ast.Constant):
            return node
        return (node.body if node.test.value else node.orelse) or ast.Pass()

    def visit_For(self, node: ast.For) -> ast.stmt:
        self.generic_visit(node)
        match node.iter:
            case ast.Call(ast.Name(id="range"), [ast.Constant(value=0)]):
                return ast.Pass()
        return node
