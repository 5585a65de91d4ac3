"""`dforce cache`: shows and removes compiled force models, and nothing else."""

import json

import pytest
from compiled import KernelCache
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A cache with two kernels, beside files of the user's."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("DFORCE_CACHE_DIR", str(folder))
    for digit in "ab":
        name = digit * 20
        (folder / name / "__pycache__").mkdir(parents=True)
        (folder / name / f"kernel_{name}.py").write_bytes(b"x" * 1000)
        (folder / name / "__pycache__" / "compiled").write_bytes(b"x" * 499_000)
    for mine in ("notes", "c" * 20):
        (folder / mine).mkdir()
        (folder / mine / "kernel_of_truth.py").write_text("mine")
    return folder


def invoke(*words):
    return CliRunner().invoke(app, ["cache", *words])


def test_the_folder_and_its_size_are_shown(folder):
    done = invoke()
    assert done.exit_code == 0 and done.stdout == f"{folder}\n2 kernels, 1.0 MB\n"
    assert json.loads(invoke("--json").stdout) == {
        "folder": str(folder), "kernels": 2, "bytes": 1_000_000, "removed": False,
    }  # fmt: skip


def test_clearing_removes_kernels_and_nothing_else(folder):
    done = invoke("--clear")
    assert done.exit_code == 0 and done.stdout == "removed: 2 kernels, 1.0 MB\n"
    assert sorted(path.name for path in folder.iterdir()) == ["c" * 20, "notes"]
    assert invoke().stdout.endswith("\n0 kernels, 0.0 MB\n")
    assert invoke("--clear").exit_code == 0


def test_a_folder_that_is_not_there_is_empty(tmp_path, monkeypatch):
    monkeypatch.setenv("DFORCE_CACHE_DIR", str(tmp_path / "no" / "such"))
    assert df.kernel_cache() == KernelCache(tmp_path / "no" / "such", 0, 0)
    assert invoke("--clear").exit_code == 0
