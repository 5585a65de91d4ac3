"""Kills of a map that a cluster computes: nothing is missing afterwards, and no bit differs.

    python benchmarks/kills.py [--kills 20] [--curves 150] [--seed 1]

`dforce sweep --cluster` writes a map in blocks of one curve, which two workers, processes of their own, compute. At random
moments a worker, the scheduler or the process that writes the store is killed with SIGKILL, as often as asked for. Another
worker takes the place of a dead one; behind a dead scheduler or writer `--resume` goes on. A map that is complete is compared
with the same one in memory, and the next one begins until all kills are done.
"""

from __future__ import annotations

import argparse
import collections
import json
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import dforce as df

KEPT = ["amplitude", "phase", "peak_force"]
KINDS = ("worker", "worker", "writer", "scheduler")  # workers twice as often
LONGEST = 1.5  # s from a block to the next kill
CURVE = 17  # points
COMMAND = f"import dforce.maps._map as m; m.MOST_POINTS = {CURVE}; from dforce.cli import main; main()"
Process = subprocess.Popen


def case(curves: int) -> df.Case:
    """Return approaches in air over so many free amplitudes."""
    zc = {"start": "12 nm", "stop": "4 nm", "points": CURVE}
    over = {"drive.A0": np.linspace(6e-9, 9e-9, curves)}
    return df.example("figure-3-air").replace(experiment=df.experiments.Approach(zc=zc), sweep={"over": over})


class Cluster:
    """A scheduler and two workers in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.file = folder, folder / "scheduler.json"
        self.file.unlink(missing_ok=True)
        self.scheduler = self._start("scheduler", "--port", "0")
        while not self.file.exists():
            time.sleep(0.1)
        self.address = json.loads(self.file.read_text())["address"]
        self.workers = [self.worker(), self.worker()]

    def _start(self, kind: str, *words: str) -> Process[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--scheduler-file", str(self.file)]
        nowhere = subprocess.DEVNULL
        return Process([*command, "--no-dashboard", *words], stdout=nowhere, stderr=nowhere, cwd=self.folder)

    def worker(self) -> Process[bytes]:
        """Start a worker."""
        return self._start("worker", "--local-directory", str(self.folder), "--nthreads", "1", "--no-nanny")

    def end(self) -> None:
        """Kill all processes."""
        for process in (self.scheduler, *self.workers):
            process.kill()
            process.wait()


def writer(folder: Path, address: str) -> Process[str]:
    """Start the command that writes the map, or goes on with it."""
    words = ["sweep", "map.toml", "-o", "map.zarr", "--keep", ",".join(KEPT), "--quiet", "--cluster", address]
    words += ["--resume"] * (folder / "map.zarr").exists()
    return Process([sys.executable, "-c", COMMAND, *words], stderr=subprocess.PIPE, text=True, cwd=folder)


def blocks(folder: Path) -> int:
    """Return how many blocks are in the store."""
    return sum(file.is_file() for file in (folder / "map.zarr" / "status" / "c").rglob("*"))


def one_map(folder: Path, draw: random.Random, kills: int) -> collections.Counter[str]:
    """Compute a map with at most so many kills; return the number of kills of each kind."""
    killed: collections.Counter[str] = collections.Counter()
    cluster = Cluster(folder)
    running = writer(folder, cluster.address)
    try:
        while True:
            before = blocks(folder)
            while running.poll() is None and (killed.total() == kills or blocks(folder) == before):
                time.sleep(0.02)
            time.sleep(draw.uniform(0.0, LONGEST))
            if running.poll() is not None:
                said = running.communicate()[1]
                if running.returncode:
                    raise SystemExit(f"the sweep ended with {running.returncode}: {said}")
                return killed
            kind = draw.choice(KINDS)
            killed[kind] += 1
            print(f"{kind} killed with {blocks(folder)} blocks in the store", flush=True)
            if kind == "worker":
                dead = cluster.workers.pop(0)
                dead.kill()
                dead.wait()
                cluster.workers.append(cluster.worker())
                continue
            (running if kind == "writer" else cluster.scheduler).kill()
            said = running.communicate()[1]  # without its scheduler it ends by itself, with a sentence
            if running.returncode == 0:  # the map was complete before the kill
                return killed
            if kind == "scheduler":
                assert "the cluster is lost" in " ".join(said.split()), said
                cluster.end()
                cluster = Cluster(folder)
            running = writer(folder, cluster.address)
    finally:
        running.kill()
        cluster.end()


def compare(folder: Path, wanted: dict[str, np.ndarray]) -> None:
    """Compare the store with the map in memory."""
    store = df.read(folder / "map.zarr")
    assert "interrupted" not in store.attrs
    assert "notes" not in store.attrs, store.attrs["notes"]
    for name, values in wanted.items():
        np.testing.assert_array_equal(store[name].values, values, err_msg=name)
    assert blocks(folder) == len(wanted["status"])
    assert not list(folder.rglob(".dforce-*.tmp"))


def main() -> None:
    """Kill, and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--curves", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    swept, draw = case(asked.curves), random.Random(asked.seed)
    memory = df.sweep(swept, quantities=KEPT)
    wanted = {name: memory[name].values for name in (*KEPT, "status")}
    killed: collections.Counter[str] = collections.Counter()
    maps = 0
    while killed.total() < asked.kills:
        with tempfile.TemporaryDirectory() as name:
            (Path(name) / "map.toml").write_text(swept.to_toml())
            killed += one_map(Path(name), draw, asked.kills - killed.total())
            compare(Path(name), wanted)
        maps += 1
    words = ", ".join(f"{kind} {count}" for kind, count in sorted(killed.items()))
    print(f"{killed.total()} kills ({words}) in {maps} maps of {asked.curves} blocks: complete, and equal bit for bit")


if __name__ == "__main__":
    main()
