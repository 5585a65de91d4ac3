"""Stops at random moments: every run ends soon, says so, and leaves a whole file.

    python benchmarks/stops.py [--stops 100] [--seed 1] [--within 10]

SIGTERM as often as asked for, and Ctrl-C as often, reach a run whose kernels are not compiled yet, a sweep, a fit and basins,
each over the result of an earlier run. A stop counts where the program ends within ten seconds with exit code 130 or 143,
and the file is whole: the old one, or a new one. Processes that are left five seconds later are counted apart. On a busy
machine the processor time that a program takes until its end shows how long it would last on a quiet one.
"""

from __future__ import annotations

import argparse
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import dforce as df

SOON, LATER = 10.0, 5.0  # s until the end, and from there until no process is left
CODES = (130, 143, -signal.SIGINT, -signal.SIGTERM)
# a shell lets programs that it starts in the background ignore Ctrl-C
PROGRAM = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from dforce.cli import main; main()"
LONGEST = 120.0  # s that a stop is waited for
MOMENTS = {"cold run": (0.5, 40.0), "sweep": (0.5, 15.0), "fit": (0.5, 15.0), "basins": (0.5, 12.0)}  # s: of the stops
MEASURED = Path(df.__file__).parent / "library" / "measured" / "air.csv"


@dataclass(frozen=True)
class Stop:
    """A stop: of which program, by which signal, after how long (s)."""

    program: str
    number: signal.Signals
    after: float


@dataclass(frozen=True)
class Ended:
    """The end of a run: the seconds until the end, seconds of a processor, exit code, whole file, processes that are left."""

    seconds: float
    used: float
    code: int | None
    whole: bool
    left: int
    load: float
    said: str

    def is_good(self, within: float) -> bool:
        """Return whether it ended within so many seconds, said that it was stopped, and left a whole file."""
        return self.code in CODES and self.seconds <= within and self.whole


def prepare(folder: Path) -> dict[str, list[str]]:
    """Write the cases and the results of earlier runs; return the command line of each program."""
    air = df.example("figure-3-air")
    curve = df.experiments.Approach(zc={"start": "12 nm", "stop": "1 nm", "points": 20_000})
    short = df.experiments.Approach(zc={"start": "12 nm", "stop": "4 nm", "points": 40})
    over = {"drive.A0": np.linspace(6e-9, 12e-9, 400), "cantilever.k": np.linspace(0.5, 2.0, 100)}
    grids = {"amplitude": {"stop": "12 nm", "points": 300}, "phase": {"points": 300}}
    shutil.copy(MEASURED, folder / "air.csv")
    cases = {
        "cold run": air.replace(experiment=curve),
        "sweep": air.replace(experiment=short, sweep={"over": over}),
        "basins": air.replace(experiment=df.experiments.Basins(zc="9 nm", **grids)),
        "fit": air.replace(
            experiment=None, fit={"free": ["forces.dmt.hamaker"], "bootstrap": 1000},
            data={"file": "air.csv", "phase_convention": "lag"},
        ),
    }  # fmt: skip
    earlier = df.run(df.example("table-1-am"))
    for name, case in cases.items():
        df.save_case(case, folder / f"{name}.toml")
        df.write(earlier, folder / f"{name}.nc")
    return {
        "cold run": ["run", "cold run.toml", "-o", "cold run.nc"], "sweep": ["sweep", "sweep.toml", "-o", "sweep.nc"],
        "fit": ["fit", "fit.toml", "-o", "fit.nc"], "basins": ["run", "basins.toml", "-o", "basins.nc"],
    }  # fmt: skip


def stopped(words: list[str], stop: Stop, folder: Path) -> Ended | None:
    """Start a program, stop it, and return its outcome; None where it had finished before."""
    environment = dict(os.environ)
    with tempfile.TemporaryDirectory() as cache:
        if stop.program == "cold run":
            environment["DFORCE_CACHE_DIR"] = cache
        mark = f"stop-{os.getpid()}-{time.monotonic_ns()}"  # by which its processes are known
        running = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *words, "--quiet"], cwd=folder, env=environment | {"DFORCE_MARK": mark},
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        before = used_by_children()
        time.sleep(stop.after)
        if running.poll() is not None:
            running.communicate()
            return None
        before += used_by(running.pid)
        running.send_signal(stop.number)
        begun = time.monotonic()
        try:
            said = running.communicate(timeout=LONGEST)[1]
        except subprocess.TimeoutExpired:
            running.kill()
            said = running.communicate()[1]
        seconds, used, load = time.monotonic() - begun, used_by_children() - before, os.getloadavg()[0]
        time.sleep(LATER)
        left = processes(mark)
        for number in left:
            os.kill(number, signal.SIGKILL)
    return Ended(seconds, used, running.returncode, is_whole(folder / words[-1]), len(left), load, said.strip())


def used_by(process: int) -> float:
    """Return the processor time (s) of a process that runs, on Linux."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def used_by_children() -> float:
    """Return the processor time (s) of all programs that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def processes(mark: str) -> list[int]:
    """Return the numbers of processes whose environment has a mark, on Linux."""
    found = []
    for file in Path("/proc").glob("[0-9]*/environ"):
        try:
            content = file.read_bytes()
        except OSError:  # ended in this moment, or another user's
            continue
        if mark.encode() in content:
            found.append(int(file.parent.name))
    return found


def is_whole(path: Path) -> bool:
    """Say whether a result can be read."""
    try:
        df.read(path)
    except df.ResultError:
        return False
    return True


def stops(count: int, draw: random.Random) -> list[Stop]:
    """Return so many stops by each signal, over all programs in turn."""
    names = list(MOMENTS)
    return [
        Stop(names[i % len(names)], number, draw.uniform(*MOMENTS[names[i % len(names)]]))
        for i in range(count)
        for number in (signal.SIGTERM, signal.SIGINT)
    ]


def main() -> None:
    """Stop, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stops", type=int, default=100, help="by each of the two signals")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--within", type=float, default=SOON, help="s until the end; 10 on a machine that does nothing else"
    )
    asked = parser.parse_args()
    row = "{:<10} {:<8} {:>8} {:>8} {:>6} {:>5} {:>6} {:>6} {:>5}  {}"
    print(
        row.format("program", "signal", "after s", "ended s", "CPU s", "code", "whole", "left", "load", ""), flush=True
    )
    every: list[Ended] = []
    with tempfile.TemporaryDirectory() as name:
        words = prepare(Path(name))
        draw = random.Random(asked.seed)
        for stop in stops(asked.stops, draw):
            while (ended := stopped(words[stop.program], stop, Path(name))) is None:
                stop = replace(stop, after=draw.uniform(MOMENTS[stop.program][0], stop.after))
            every.append(ended)
            miss = "" if ended.is_good(asked.within) else f"MISS {ended.said[-200:]}"
            cells = (
                f"{stop.after:.1f}",
                f"{ended.seconds:.1f}",
                f"{ended.used:.1f}",
                ended.code,
                ended.whole,
                ended.left,
                f"{ended.load:.1f}",
            )
            print(row.format(stop.program, stop.number.name, *map(str, cells), miss), flush=True)
    good, left = sum(one.is_good(asked.within) for one in every), sum(one.left > 0 for one in every)
    slowest = max(one.seconds for one in every)
    print(f"{good} of {len(every)} stops ended within {asked.within:g} s with the file whole; slowest {slowest:.1f} s")
    print(f"processor time until the end: {max(one.used for one in every):.1f} s at most")
    print(f"processes left {LATER:g} s later: after {left} of {len(every)} stops")
    sys.exit(good < len(every))


if __name__ == "__main__":
    main()
