"""A sweep on a Dask cluster: the numbers of threads, whatever is killed meanwhile."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import dforce as df

distributed = pytest.importorskip("distributed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="has no SIGKILL"),
    pytest.mark.filterwarnings("ignore"),  # of distributed, when its processes are killed
]

OVER = {"sample.youngs_modulus": np.geomspace(0.3e9, 3e9, 12), "drive.A0": [6e-9, 7e-9, 8e-9, 9e-9]}
PLUGIN = '''
import dforce as df


class Spring(df.Force):
    """Linear force."""

    name = "spring_of_a_cluster"
    stiffness: float = df.param("0.05 N/m", low="0 N/m", doc="stiffness of the spring")

    @staticmethod
    def law(d, rate, t, stiffness):
        return -stiffness * d
'''


def case(**changes: object) -> df.Case:
    values = {
        "cantilever": df.Cantilever(f0="50 kHz", k=1.0, Q=100.0),
        "drive": df.Drive(A0="8 nm"),
        "tip": df.Tip(radius="5 nm"),
        "sample": df.Sample(youngs_modulus="1 GPa"),
        "forces": [df.forces.DMT(hamaker="3e-20 J")],
        "experiment": df.experiments.Approach(zc={"start": "12 nm", "stop": "6 nm", "points": 9}),
    }
    return df.Case(**values | changes)


class Processes:
    """A scheduler and workers of a cluster, each a process that may be killed."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.file = folder, folder / "scheduler.json"
        self.all: list[subprocess.Popen[bytes]] = []
        self.scheduler = self._start("scheduler", "--scheduler-file", str(self.file), "--port", "0", "--no-dashboard")
        for _ in range(200):
            if self.file.exists():
                break
            time.sleep(0.1)
        self.workers = [self.worker(), self.worker()]

    def _start(self, *words: str) -> subprocess.Popen[bytes]:
        started = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_" + words[0], *words[1:]],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=self.folder,
        )  # fmt: skip
        self.all.append(started)
        return started

    def worker(self) -> subprocess.Popen[bytes]:
        where = ("--scheduler-file", str(self.file), "--local-directory", str(self.folder))
        return self._start("worker", *where, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--death-timeout", "60")

    def end(self) -> None:
        for process in self.all:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            process.wait()


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[Processes]:
    started = Processes(tmp_path)
    yield started
    started.end()


@pytest.fixture
def client(processes: Processes) -> Iterator[Any]:
    with distributed.Client(scheduler_file=str(processes.file), timeout=8) as client:
        client.wait_for_workers(2)
        yield client


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cut every map into blocks of one case."""
    monkeypatch.setattr("dforce.maps._map.MOST_POINTS", 9)


def same(one: xr.Dataset, other: xr.Dataset) -> None:
    xr.testing.assert_identical(one.load().assign_attrs(date=""), other.load().assign_attrs(date=""))


@pytest.mark.long
def test_a_cluster_finds_the_numbers_of_threads_and_its_workers_may_be_killed(processes, client, tmp_path):
    threads = df.sweep(case(), OVER, store=tmp_path / "threads.zarr")
    same(df.sweep(case(), OVER, store=tmp_path / "cluster.zarr", client=client), threads)
    left = [10, 25]  # blocks after which a worker is killed

    def kill(done: int, total: int, note: str) -> None:
        if left and done >= 9 * left[0]:
            left.pop(0)
            processes.workers.pop(0).kill()
            processes.workers.append(processes.worker())

    killed = df.sweep(case(), OVER, store=tmp_path / "killed.zarr", client=client, progress=kill)
    assert not left
    same(killed, threads)


@pytest.mark.long
def test_the_command_uses_a_running_cluster_and_goes_on_without_it(processes, client, tmp_path):
    over = OVER | {"drive.A0": np.linspace(6e-9, 9e-9, 20)}
    (tmp_path / "map.toml").write_text(case(sweep={"over": over}).to_toml())
    address = client.scheduler.address

    def begun(out: str, *words: str) -> subprocess.Popen[str]:
        small = "import dforce.maps._map as m; m.MOST_POINTS = 9; from dforce.cli import main; main()"
        sweep = ["sweep", "map.toml", "-o", out, "--keep", "amplitude", "--quiet", *words]
        return subprocess.Popen([sys.executable, "-c", small, *sweep], stderr=subprocess.PIPE, text=True, cwd=tmp_path)

    whole = begun("whole.zarr", "--cluster", address)
    assert (whole.communicate()[1], whole.returncode) == ("", 0)
    lost = begun("lost.zarr", "--cluster", address)
    while lost.poll() is None and not (tmp_path / "lost.zarr" / "status" / "c" / "1").exists():
        time.sleep(0.01)
    processes.scheduler.kill()
    sentence = "dforce: the cluster is lost; finished blocks are kept, and another cluster can continue"
    assert (" ".join(lost.communicate()[1].split()), lost.returncode) == (sentence, 2)
    assert df.read(tmp_path / "lost.zarr").attrs["interrupted"] == 1
    rest = begun("lost.zarr", "--resume", "--workers", "2")
    assert (rest.communicate()[1], rest.returncode) == ("", 0)
    same(df.read(tmp_path / "lost.zarr"), df.read(tmp_path / "whole.zarr"))


@pytest.mark.long
def test_a_plug_in_travels_with_its_case(client, workdir):
    (workdir / "spring.py").write_text(PLUGIN)
    swept = case(plugins=["spring.py"], forces=[{"model": "spring_of_a_cluster"}])
    over = {"forces.1.stiffness": [0.01, 0.02, 0.03]}
    cluster = df.sweep(swept, over, store=workdir / "cluster.zarr", client=client)
    assert "notes" not in cluster.attrs
    same(cluster, df.sweep(swept, over, store=workdir / "threads.zarr"))


@pytest.mark.long
def test_without_its_scheduler_a_sweep_ends_with_a_sentence_and_goes_on_elsewhere(processes, client, tmp_path):
    def kill(done: int, total: int, note: str) -> None:
        if done > total // 3:
            processes.scheduler.kill()

    with pytest.raises(df.ResultError, match="the cluster is lost; finished blocks are kept"):
        df.sweep(case(), OVER, store=tmp_path / "lost.zarr", client=client, progress=kill)
    assert df.read(tmp_path / "lost.zarr").attrs["interrupted"] == 1
    rest = df.sweep(case(), OVER, store=tmp_path / "lost.zarr", resume=True)
    same(rest, df.sweep(case(), OVER, store=tmp_path / "threads.zarr"))


def test_a_cluster_that_does_not_answer_is_one_sentence(tmp_path):
    import dask

    short = dask.config.set({"distributed.comm.timeouts.connect": "1s"})
    with short, pytest.raises(df.ResultError, match="no cluster answers"):
        df.sweep(case(), OVER, store=tmp_path / "map.zarr", client="tcp://127.0.0.1:1")
    with pytest.raises(df.ParameterError, match="a cluster has its own"):
        df.sweep(case(), OVER, store=tmp_path / "other.zarr", client="tcp://127.0.0.1:1", workers=2)
