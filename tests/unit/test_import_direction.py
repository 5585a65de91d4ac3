"""Imports run one way through dForce, from what is typed at the edge down to errors and units."""

import ast
import functools
import re
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import counts

import dforce

PACKAGE = Path(dforce.__file__).parent

# Each module may import its own level and those above it in this list. A folder counts as one module.
LEVELS = (
    ("_version", "core"),
    ("library",),
    ("forces", "instrument"),
    ("problem",),
    ("kernel",),
    ("observables",),
    ("integrators", "engine"),
    ("solvers",),
    ("results",),
    ("experiments",),
    ("case",),
    ("validity", "plot", "procedures"),
    ("runs", "findings", "spectroscopy", "maps", "thermal"),
    ("inverse",),
    ("checks",),
    ("__init__",),
    ("cli", "gui", "__main__"),
)
LEVEL = {module: level for level, modules in enumerate(LEVELS) for module in modules}

# These show what others compute; what computes is closed to them.
EDGE = ("cli", "gui")
INSIDE = ("kernel", "integrators", "engine", "solvers")

# `import dforce` must be quick, so these wait until something needs them.
HEAVY = (
    "igor2",
    "numba",
    "pint",
    "scipy",
    "xarray",
    "matplotlib",
    "typer",
    "h5netcdf",
    "h5py",
    "pandas",
    "nicegui",
    "plotly",
)


def files() -> dict[str, Path]:
    """Return every source file by its dotted name within the package ('' is the package itself)."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


FILES = files()


def component(name: str) -> str:
    """Return the module or folder at the top of the package that a dotted name belongs to."""
    return name.split(".", maxsplit=1)[0] or "__init__"


def parse(path: Path) -> ast.Module:
    """Return the syntax tree of a source file."""
    return ast.parse(path.read_text(encoding="utf-8"), filename=str(path))


def running_nodes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes that can run, functions' bodies included: all but the bodies of `if TYPE_CHECKING`."""
    yield node
    if isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING"):
        for child in node.orelse:
            yield from running_nodes(child)
    else:
        for child in ast.iter_child_nodes(node):
            yield from running_nodes(child)


@functools.cache
def imports(name: str, path: Path) -> list[tuple[str, str, int]]:
    """Return (file of dForce, name taken from it or '', line) for every import of dForce in a file."""
    return list(read_imports(name, path))


def read_imports(name: str, path: Path) -> Iterator[tuple[str, str, int]]:
    """Yield the imports of dForce in a file."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    for node in running_nodes(parse(path)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.split(".")[0] == "dforce":
                    yield alias.name.partition(".")[2], "", node.lineno
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                start = package[: len(package) - node.level + 1]
                base = ".".join([*start, *(node.module or "").split(".")]).strip(".")
            elif (node.module or "").split(".")[0] == "dforce":
                base = (node.module or "").partition(".")[2]
            else:
                continue
            for alias in node.names:
                inner = f"{base}.{alias.name}".strip(".")
                if inner in FILES:
                    yield inner, "", node.lineno
                else:
                    yield base, alias.name, node.lineno


def test_every_module_has_a_level() -> None:
    homeless = {component(name) for name in FILES} - set(LEVEL)
    assert not homeless, f"put {', '.join(sorted(homeless))} in a level of LEVELS"


def test_no_module_imports_from_a_later_level() -> None:
    wrong = [
        f"{path.relative_to(PACKAGE)}:{line} imports {target or 'dforce'}"
        for name, path in FILES.items()
        if component(name) not in EDGE
        for target, _, line in imports(name, path)
        if LEVEL.get(component(target), 0) > LEVEL.get(component(name), 0)
    ]
    assert not wrong, "\n".join(wrong)


def test_modules_of_one_level_do_not_import_each_other_in_a_circle() -> None:
    graph: dict[str, set[str]] = {}
    for name, path in FILES.items():
        neighbors = graph.setdefault(component(name), set())
        neighbors.update(component(target) for target, _, _ in imports(name, path))
        neighbors.discard(component(name))
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        raise AssertionError("these import each other: " + " -> ".join(error.args[1])) from None


def test_cli_and_gui_never_touch_kernels_or_solvers() -> None:
    wrong = [
        f"{path.relative_to(PACKAGE)}:{line} imports {target}"
        for name, path in FILES.items()
        if component(name) in EDGE
        for target, _, line in imports(name, path)
        if component(target) in INSIDE
    ]
    assert not wrong, "\n".join(wrong)


def test_files_import_each_other_in_no_circle() -> None:
    assert not (found := counts.circles(counts.trees())), "\n".join(" > ".join(circle) for circle in found)


def test_every_place_that_the_map_names_is_there() -> None:
    root = Path(__file__).parents[2]
    page = (root / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`([a-z_]+/[a-z_/]*(?:\.py)?|[a-z_]+\.py)`", page))
    assert len(named) > 30
    assert not [place for place in sorted(named) if not (PACKAGE / place).exists() and not (root / place).exists()]
    rooms = {path.name for path in PACKAGE.iterdir() if path.is_dir() and (path / "__init__.py").exists()}
    assert rooms <= {place.rstrip("/") for place in named}


def test_nobody_reads_what_another_folder_calls_its_own() -> None:
    wrong = [
        f"{path.relative_to(PACKAGE)}:{line} imports {target} {taken}"
        for name, path in FILES.items()
        for target, taken, line in imports(name, path)
        if is_own(f"{target}.{taken}", name if path.name == "__init__.py" else name.rpartition(".")[0])
    ]
    assert not wrong, "\n".join(wrong)


def is_own(dotted: str, folder: str) -> bool:
    """Return whether a dotted name is private to a folder other than the one given."""
    parts = dotted.split(".")
    return any(
        part.startswith("_") and not part.startswith("__") and ".".join(parts[:place]) not in ("", folder)
        for place, part in enumerate(parts)
    )


def test_the_package_exports_only_what_it_says() -> None:
    missing = [name for name in dir(dforce) if not hasattr(dforce, name)]
    assert not missing


def test_importing_dforce_loads_nothing_heavy() -> None:
    code = f"import sys, dforce; print(*sorted(set(sys.modules) & set({HEAVY!r})))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert loaded.stdout.split() == []


# What comes with an extra alone. Of the package the window needs it to be loaded, and what zarr reads stores through.
OPTIONAL = {"zarr", "distributed", "dask", "fsspec", "igor2", "nicegui", "plotly"}
OF_EXTRAS = ("gui", "results.checked")
TESTS = Path(__file__).parents[1]
OF_THE_WINDOW = ("dforce.gui", "nicegui", "plotly", "playwright", "simulated")


def test_all_but_the_window_loads_without_what_comes_with_an_extra() -> None:
    found = set()
    for name, path in FILES.items():
        taken = set() if name.startswith(OF_EXTRAS) else taken_at_once(path)
        if {one.partition(".")[0] for one in taken} & OPTIONAL or "dforce.results.checked" in taken:
            found.add(name)
    assert found == set()


def test_tests_of_all_but_the_window_load_without_it() -> None:
    others = [path for path in TESTS.glob("*/test_*.py") if path.parent.name not in ("gui", "browser")]
    assert len(others) > 100
    found = {path.name for path in others for one in taken_at_once(path) if one.startswith(OF_THE_WINDOW)}
    assert found == set()


def taken_at_once(path: Path) -> set[str]:
    """Return the names of modules and objects that a file imports when it is loaded."""
    nodes = [node for node in parse(path).body if isinstance(node, ast.Import | ast.ImportFrom)]
    return {alias.name for node in nodes for alias in node.names} | {
        getattr(node, "module", None) or "" for node in nodes
    }
