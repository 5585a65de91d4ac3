"""Input of users goes through one opener: regular files alone, within the limit of their kind."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import dforce as df
from dforce.core.errors import CaseError, ParameterError, ResultError
from dforce.core.files import read_input

POSIX = pytest.mark.skipif(os.name != "posix", reason="no devices and pipes in the file system")
PACKAGE = Path(df.__file__).parent
READS = (
    "read_text", "read_bytes", "FileIO", "loadtxt", "genfromtxt", "fromfile", "memmap", "open_zarr", "open_dataset",
    "load_dataset", "open_mfdataset", "File", "ZipFile", "read_csv",
)  # fmt: skip
SHIPPED = re.compile(r"resources\.files\(|__file__")  # with the package
NOT_OF_USERS = {
    "core/files.py": "the opener itself, and what is written",
    "results/files.py": "libraries on the bytes that the opener gave",
    "results/store.py": "zarr on files that went through the opener",
    "results/hdf5_child.py": "a library on the bytes of its standard input",
    "case/_files.py": "a library on the bytes that the opener gave",
    "gui/files/project.py": "an archive in memory, each entry within a limit",
    "gui/files/file_menu.py": "shipped with the package; what this process has just written",
    "gui/window/address.py": "shipped with the package",
    "gui/window/pages.py": "shipped with the package",
    "gui/document/store.py": "what the window wrote for itself",
    "gui/window/security.py": "the secret that the window wrote for itself",
    "kernel/cache.py": "compiled code of dForce's own",
    "kernel/cache_files.py": "compiled code of dForce's own",
    "kernel/texts.py": "sources of the package",
    "library/__init__.py": "shipped with the package",
    "cli/_streams.py": "the system's sink for a closed stream",
}


def reads(node):
    """Say whether a call opens or reads a file by its path."""
    if isinstance(node.func, ast.Name):
        return node.func.id == "open"
    if not isinstance(node.func, ast.Attribute):
        return False
    if node.func.attr == "load":
        return isinstance(node.func.value, ast.Name) and node.func.value.id in ("np", "tomllib", "json")
    if node.func.attr == "open":  # views and panels are opened, too; files with a mode or an encoding
        modes = [one for one in node.args if isinstance(one, ast.Constant) and isinstance(one.value, str)]
        return bool(modes or node.keywords) or ast.unparse(node.func.value) in ("os", "io")
    return node.func.attr in READS


def calls():
    """Give each call in the package that reads a file by itself, and the module that it is in."""
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and reads(node) and not SHIPPED.search(ast.unparse(node)):
                yield path.relative_to(PACKAGE).as_posix(), f"line {node.lineno}: {ast.unparse(node)[:60]}"


def test_no_other_module_opens_input_of_users():
    others = [f"{module}, {call}" for module, call in calls() if module not in NOT_OF_USERS]
    assert not others, "read these by dforce.core.files.read_input"


def test_each_exception_is_still_one():
    assert set(NOT_OF_USERS) == {module for module, _ in calls() if module in NOT_OF_USERS}


# each kind of file of users, by the function that reads it
KINDS = {
    "case": lambda path: df.load_case(path),
    "measured file": lambda path: df.read_measured(path),
    "thermal spectrum": lambda path: df.thermal_tune(path),
    "result": lambda path: df.read(path),
    "plan": lambda path: df.load_plan(path),
    "plug-in": lambda path: df.load_plugin(path),
    "library": lambda path: df.Case(cantilever={"name": "mine", "library": str(path)}, drive={"A0": "1 nm"}),
    "drift": lambda path: df.Drift(file=str(path)),
    "table of cases": lambda path: df.sweep(df.example("figure-3-air").replace(sweep={"rows": str(path)})),
}
ENDINGS = {"plug-in": ".py", "library": ".csv", "drift": ".csv", "table of cases": ".csv"}


@POSIX
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("device", ["/dev/zero", "fifo"])
def test_a_device_or_a_pipe_is_refused_at_once(tmp_path, kind, device):
    path = tmp_path / f"input{ENDINGS.get(kind, '.csv')}"
    if device == "fifo":
        os.mkfifo(path)
    else:
        path.symlink_to(device)
    with pytest.raises(df.DForceError, match="is not an ordinary file"):
        KINDS[kind](path)


@pytest.mark.parametrize("kind", KINDS)
def test_a_sparse_file_is_refused_by_its_size(tmp_path, kind):
    path = tmp_path / f"input{ENDINGS.get(kind, '.csv')}"
    with path.open("wb") as file:
        file.truncate(5_000_000_000)
    with pytest.raises(df.DForceError, match=r"is larger than [0-9.]+ (MB|GB), the limit for a "):
        KINDS[kind](path)


@pytest.mark.parametrize("kind", KINDS)
def test_a_folder_is_named_so_where_the_system_denies_the_permission_to_open_it(tmp_path, monkeypatch, kind):
    path = tmp_path / f"input{ENDINGS.get(kind, '.csv')}"
    path.mkdir()
    opened = os.open

    def denied(path, *rest, **more):
        if os.path.isdir(path):  # noqa: PTH112
            raise PermissionError(13, "Permission denied")  # as on Windows
        return opened(path, *rest, **more)

    monkeypatch.setattr(os, "open", denied)
    with pytest.raises(df.DForceError, match="is a folder, not a file"):
        KINDS[kind](path)


@POSIX
def test_a_store_whose_metadata_are_a_pipe_is_refused(tmp_path):
    store = tmp_path / "map.zarr"
    store.mkdir()
    os.mkfifo(store / "zarr.json")
    with pytest.raises(df.ResultError, match="is not an ordinary file"):
        df.read(store)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no /proc")
def test_a_file_of_the_system_without_a_size_is_read_to_its_end():
    assert read_input("/proc/self/status", "status", 1_000_000, ResultError).startswith(b"Name:")


@pytest.mark.parametrize("size", [0, 9, 10, 11, 200_000])
def test_no_more_than_the_limit_is_read(tmp_path, size):
    (tmp_path / "a").write_bytes(b"x" * size)
    if size <= 10:
        assert len(read_input(tmp_path / "a", "test", 10, CaseError)) == size
    else:
        with pytest.raises(CaseError, match=r"'.*a' is larger than 10 bytes, the limit for a test"):
            read_input(tmp_path / "a", "test", 10, CaseError)


def test_a_link_to_a_file_is_followed_and_a_beginning_may_allow_more(tmp_path):
    (tmp_path / "a").write_bytes(b"BIG" + bytes(100_000))
    (tmp_path / "b").symlink_to(tmp_path / "a")
    assert len(read_input(tmp_path / "b", "test", 10, CaseError, larger={b"BIG": 200_000})) == 100_003


def test_a_missing_file_of_a_key_is_named_by_it(tmp_path):
    with pytest.raises(ParameterError, match=r"^key = 'a.csv': there is no such file$"):
        read_input(tmp_path / "a.csv", "table", 10, ParameterError, name="key = 'a.csv'")


@POSIX
def test_reading_a_device_takes_no_memory():
    code = (
        "import resource, dforce as df\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "try: df.read_measured('/dev/zero')\n"
        "except df.ResultError as error: print(error)\n"
        "print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) // 1024)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    said, grown = done.stdout.splitlines()
    assert re.search("'/dev/zero' is not an ordinary file", said)
    assert int(grown) < 100  # MB
