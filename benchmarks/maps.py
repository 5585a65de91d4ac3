"""The cost of a map: its blocks in the store, the tasks of a cluster's scheduler, and from both a map of 10^8 points.

    python benchmarks/maps.py [--blocks 200] [--tasks 10000] [--cluster] [--random 2000] [--points 1000000 2000000 4000000]

The same curves are computed in memory and in a store, once in blocks of the usual size and once in blocks of one curve, whose
time is the block's own. With --cluster so many empty blocks pass a real scheduler and two workers in other processes, as in a
map: never more known than two for each thread. With --random so many random polymers of the tutorial on maps are computed
instead, and the hours of a million are printed. With --points so many settled points, in curves of 201, go to a store, each
number in another process: with its largest memory, and its speed beside the speed of the same curves solved in one block and
kept nowhere.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import tempfile
import time
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

import dforce as df
from dforce.maps import _executors, _map
from dforce.maps._kept import Kept

CURVE = 101  # points
LONG = 201  # points of each curve of a million points
BARE = 200  # curves that are solved and kept nowhere
LARGE = 1e8  # points of the map on paper
MILLION = 1e6  # random cases
KEPT = ["amplitude", "phase", "peak_force"]


def case(points: int = CURVE) -> df.Case:
    """Return an approach in air."""
    zc = {"start": "12 nm", "stop": "4 nm", "points": points}
    return df.example("figure-3-air").replace(experiment=df.experiments.Approach(zc=zc))


def sizes(store: Path) -> tuple[int, int]:
    """Return the bytes and the files of a store."""
    files = [file.stat().st_size for file in store.rglob("*") if file.is_file()]
    return sum(files), len(files)


def timed(cases: int, points: int = CURVE, **settings: Any) -> tuple[float, float]:
    """Return the time (s) of a sweep over so many curves by the clock, and the processors' time."""
    draw = np.random.default_rng(1)
    rows = {"drive.A0": draw.uniform(6e-9, 9e-9, cases), "forces.dmt.hamaker": draw.uniform(1e-20, 4e-20, cases)}
    clock, used = time.perf_counter(), time.process_time()
    df.sweep(case(points), rows=rows, quantities=KEPT, **settings)
    return time.perf_counter() - clock, time.process_time() - used


def stores(folder: Path, blocks: int) -> tuple[float, int, float]:
    """Print the cost of points and blocks; return the processors' time of a point (s), the arrays, and the bytes of a point."""
    timed(8)  # compiles
    cases = 20 * blocks
    points = cases * CURVE
    memory, store = timed(cases), timed(cases, store=folder / "large.zarr")
    size, files = sizes(folder / "large.zarr")
    for where, (clock, used) in (("in memory", memory), ("in a store", store)):
        print(f"{points} points {where}: {points / clock:.0f} a second, {1e6 * used / points:.1f} us of a core each")
    print(f"the store: {size / points:.1f} bytes a point in {files} files")
    with mock.patch.object(_map, "MOST_POINTS", CURVE):
        clock, used = timed(blocks, store=folder / "small.zarr")
    size_of_all, files = sizes(folder / "small.zarr")
    alone = clock / blocks - memory[0] / cases, used / blocks - memory[1] / cases
    arrays = round((files - 20) / blocks)
    print(f"{blocks} blocks of one curve: {1e3 * alone[0]:.0f} ms each beside the curve ({1e3 * alone[1]:.0f} ms of a core), "
          f"{files / blocks:.1f} files, {size_of_all / blocks:.0f} bytes")  # fmt: skip
    return store[1] / points, arrays, size / points


def nothing(sent: object, axes: object) -> _executors.Arrays:
    """Compute an empty block."""
    return {}


def scheduler(folder: Path, tasks: int) -> float:
    """Pass empty blocks through a real scheduler; return how many a second."""
    import distributed

    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, local_directory=str(folder)
    )
    with cluster, distributed.Client(cluster) as client:
        hands = _executors.Cluster(case(), Kept(frozenset(KEPT)), client)
        pending, begun, done, start = set(), 0, 0, time.perf_counter()
        while done < tasks:
            room = hands.room()
            while begun < tasks and len(pending) < room:
                pending.add(hands._pool.submit(nothing, hands._sent, []))
                begun += 1
            finished = _map.wait(pending, _map.LOOK, _map.FIRST_COMPLETED).done
            pending -= finished
            done += sum(not future.result() for future in finished)
        rate = tasks / (time.perf_counter() - start)
        hands.close()
    print(f"{tasks} empty blocks through a scheduler and two workers: {rate:.0f} a second, at most {room} known to it")
    return rate


def random_cases(folder: Path, cases: int) -> None:
    """Print the cost of random polymers, whose curves jump more often than not."""
    draw = np.random.default_rng(16)
    polymer = df.Case(
        cantilever=df.Cantilever(f0="70 kHz", k="2.7 N/m", Q=180.0),
        drive=df.Drive(A0="40 nm"),
        tip=df.Tip(radius="8 nm"),
        sample=df.Sample(youngs_modulus="2 GPa", poisson_ratio=0.3),
        forces=[df.forces.DMT(hamaker="6e-20 J")],
        experiment=df.experiments.Approach(zc={"of": "drive.A0", "start": 1.1, "stop": 0.7, "points": 17}),
    )
    rows = {
        "sample.youngs_modulus": np.exp(draw.uniform(np.log(0.3e9), np.log(10e9), cases)),
        "forces.dmt.hamaker": draw.uniform(1e-20, 8e-20, cases),
        "drive.A0": draw.uniform(10e-9, 60e-9, cases),
    }
    kept = ["amplitude_ratio", "phase"]
    df.sweep(polymer, rows={path: values[:8] for path, values in rows.items()}, quantities=kept)  # compiles
    used = time.process_time()
    found = df.sweep(polymer, rows=rows, quantities=kept, store=folder / "random.zarr")
    a_case = (time.process_time() - used) / cases
    jumped = float(np.isfinite(found["jump_zc"].values).any(axis=1).mean()) if "jump_zc" in found else 0.0
    hours = MILLION * a_case / 3600.0
    print(f"{cases} random cases of 17 points, {100 * jumped:.0f} % of them with a jump: {1e3 * a_case:.1f} ms of a core each; "
          f"{MILLION:.0e} of them: {hours:.1f} hours of one core, {60 * hours / 64:.1f} minutes of 64")  # fmt: skip


def many(points: int) -> tuple[float, float, float, float]:
    """Return, of so many points that go to a store: time (s) by the clock and of the processors, share of the speed of few
    curves in memory, and the largest memory of the process (MB)."""
    timed(8, LONG)  # compiles
    bare = min(timed(BARE, LONG)[1] for _ in range(3)) / BARE
    curves = round(points / LONG)
    with tempfile.TemporaryDirectory() as name:
        clock, used = timed(curves, LONG, store=Path(name) / "many.zarr")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3  # in kB, as Linux counts it
    return clock, used, bare * curves / used, peak


def main() -> None:
    """Measure, and print the plan."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--blocks", type=int, default=200)
    parser.add_argument("--tasks", type=int, default=10_000)
    parser.add_argument("--cluster", action="store_true")
    parser.add_argument("--random", type=int, default=0)
    parser.add_argument("--points", type=int, nargs="+", default=[])
    asked = parser.parse_args()
    for points in asked.points:
        with multiprocessing.get_context("spawn").Pool(1) as one:
            clock, used, share, peak = one.apply(many, (points,))
        print(f"{points} points to a store: {clock:.0f} s, {used:.0f} s of the processors, {points / clock:.0f} a second, "
              f"{100 * share:.0f} % of the speed in memory; {peak:.0f} MB", flush=True)  # fmt: skip
    if asked.points:
        return
    with tempfile.TemporaryDirectory() as name:
        if asked.random:
            random_cases(Path(name), asked.random)
            return
        a_point, arrays, a_size = stores(Path(name), asked.blocks)
        rate = scheduler(Path(name), asked.tasks) if asked.cluster else None
    blocks = LARGE / _map.MOST_POINTS
    hours = LARGE * a_point / 3600.0
    print(f"{LARGE:.0e} such points: {hours:.2f} hours of one core, {60 * hours / 64:.1f} minutes of 64; "
          f"{LARGE * a_size / 1e9:.2f} GB, {blocks:.0f} blocks, {arrays * blocks:.0f} files")  # fmt: skip
    if rate is not None:
        print(f"the scheduler passes these blocks in {blocks / rate:.0f} s")


if __name__ == "__main__":
    main()
