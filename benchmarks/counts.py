"""How large the house is: lines, statements, classes, arguments, `Any`, imports inside functions, circles of files.

python benchmarks/counts.py [--json] [--list arguments|laws|names|imports|any|circles]
"""

from __future__ import annotations

import argparse
import ast
import itertools
import json
from collections import Counter
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

PACKAGE = Path(__file__).parent.parent / "src" / "dforce"
CORE = ("kernel", "integrators", "engine", "observables", "solvers")
MOST_ARGUMENTS = 8
LAW = ("law", "evolve", "switch")  # of a force: their arguments are its parameters
Function = ast.FunctionDef | ast.AsyncFunctionDef


def trees() -> dict[str, ast.Module]:
    """Return the syntax tree of each file by its dotted name within the package."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = ast.parse(path.read_text(encoding="utf-8"), filename=str(path))
    return found


def functions(tree: ast.AST) -> Iterator[Function]:
    """Give all functions of a tree."""
    return (node for node in ast.walk(tree) if isinstance(node, Function))


def arguments(function: Function) -> int:
    """Return how many arguments a function has, `self` and `cls` left out."""
    given = function.args
    names = [one.arg for one in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    return len([name for name in names if name not in ("self", "cls")])


def imported(node: ast.AST) -> list[str]:
    """Return the modules of dForce that an import statement may name."""
    if isinstance(node, ast.Import):
        names = [one.name for one in node.names]
    elif isinstance(node, ast.ImportFrom) and node.module:
        names = [node.module, *(f"{node.module}.{one.name}" for one in node.names)]
    else:
        return []
    return [name.removeprefix("dforce").removeprefix(".") for name in names if name.split(".")[0] == "dforce"]


def circles(files: dict[str, ast.Module]) -> list[list[str]]:
    """Return the circles of files, imports under TYPE_CHECKING and inside functions counted; one for each knot."""
    needs = {
        name: {
            other for node in ast.walk(tree) for other in imported(node) if other in files and other not in ("", name)
        }
        for name, tree in files.items()
    }
    # a name that a package hands on comes from its file: the package itself is left out where a file of it is named
    for name, others in needs.items():
        needs[name] = {other for other in others if not any(deeper.startswith(f"{other}.") for deeper in others)}
    found = []
    while True:
        try:
            TopologicalSorter(needs).prepare()
        except CycleError as error:
            circle = error.args[1][:-1]
            found.append(circle)
            needs[circle[-1]].discard(circle[0])
            needs[circle[0]].discard(circle[-1])
            for first, second in itertools.pairwise(circle):
                needs[second].discard(first)
        else:
            return found


def rows(files: dict[str, ast.Module]) -> dict[str, list[str]]:
    """Return the counted things by name, each as the list of its places."""
    out: dict[str, list[str]] = {"arguments": [], "laws": [], "imports": [], "any": [], "names": []}
    classes = Counter(node.name for tree in files.values() for node in tree.body if isinstance(node, ast.ClassDef))
    out["names"] = [f"{name}: {count} files" for name, count in classes.items() if count > 1]
    for name, tree in files.items():
        for function in functions(tree):
            place = f"{name}:{function.lineno} {function.name}"
            if arguments(function) > MOST_ARGUMENTS:
                law = name.startswith("forces.") and function.name in LAW
                out["laws" if law else "arguments"].append(f"{place}: {arguments(function)}")
            inner = [node for part in function.body for node in ast.walk(part) if imported(node)]
            out["imports"] += [f"{place}: {imported(node)[0]}" for node in inner]
            hints = [one.annotation for one in (*function.args.args, *function.args.kwonlyargs)]
            out["any"] += [place for hint in hints if hint is not None and "Any" in ast.unparse(hint)]
    return {key: sorted(set(places)) if key == "imports" else places for key, places in out.items()}


def counts(files: dict[str, ast.Module]) -> dict[str, int]:
    """Return the figures by name."""
    text = [path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")]
    outside = {name: tree for name, tree in files.items() if name.split(".")[0] not in CORE}
    every, rim = rows(files), rows(outside)
    return {
        "files": len(files),
        "lines": sum(one.count("\n") for one in text),
        "statements": sum(isinstance(node, ast.stmt) for tree in files.values() for node in ast.walk(tree)),
        "functions": sum(1 for tree in files.values() for _ in functions(tree)),
        "classes": sum(isinstance(node, ast.ClassDef) for tree in files.values() for node in ast.walk(tree)),
        "class names in several files": len(every["names"]),
        f"laws of forces with more than {MOST_ARGUMENTS} arguments, their parameters": len(every["laws"]),
        f"other functions with more than {MOST_ARGUMENTS} arguments": len(every["arguments"]),
        f"of these outside {', '.join(CORE)}": len(rim["arguments"]),
        "arguments of type Any": len(every["any"]),
        f"of these arguments outside {', '.join(CORE)}": len(rim["any"]),
        "imports of dforce inside functions": len(every["imports"]),
        "fmt: skip": sum(one.count("# fmt: skip") for one in text),
        "files over 400 lines": sum(one.count("\n") > 400 for one in text),
        "circles of files": len(circles(files)),
    }


def main() -> None:
    """Print the figures, or the places of one of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--list", choices=("arguments", "laws", "names", "imports", "any", "circles"))
    asked = parser.parse_args()
    files = trees()
    if asked.list:
        print(*(map(" > ".join, circles(files)) if asked.list == "circles" else rows(files)[asked.list]), sep="\n")
    elif asked.json:
        print(json.dumps(counts(files)))
    else:
        for name, value in counts(files).items():
            print(f"{value:7,d}  {name}")


if __name__ == "__main__":
    main()
