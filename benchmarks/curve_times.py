"""CPU time of curves, a point, in u = one RK4 period by hand; parts that do not depend on the solver are printed apart.

`benchmarks/judge.py --times` prints it.
"""

from __future__ import annotations

import math
import os
import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import Any
from unittest import mock

import handwritten
import xarray as xr

import dforce as df
from dforce.procedures.curve import PlannedCurve
from dforce.results.status import Status, whole

STIFF = {
    "cantilever": {"f0": "300 kHz", "k": "40 N/m", "Q": 400}, "drive": {"A0": "20 nm"}, "tip": {"radius": "10 nm"},
    "sample": {"youngs_modulus": "2 GPa", "poisson_ratio": 0.3},
}  # fmt: skip
WATER = {
    "cantilever": {"f0": "30 kHz", "k": "0.5 N/m", "Q": 2}, "drive": {"A0": "10 nm"}, "tip": {"radius": "10 nm"},
    "sample": {"youngs_modulus": "50 MPa", "poisson_ratio": 0.3}, "forces": [{"model": "hertz"}],
}  # fmt: skip
THERE_AND_BACK = {"start": "24 nm", "stop": "8 nm", "points": 201}


def approach(start: str, stop: str, points: int = 201, direction: str = "approach") -> dict[str, Any]:
    """Return an approach as an experiment."""
    return {"kind": "approach", "direction": direction, "zc": {"start": start, "stop": stop, "points": points}}


def moduli(low: str, high: str) -> dict[str, Any]:
    """Return 64 moduli to sweep over."""
    return {"sample.youngs_modulus": {"start": low, "stop": high, "points": 64, "spacing": "log"}}


def timed_cases() -> dict[str, tuple[bool, Callable[[], xr.Dataset]]]:
    """Return by name whether a case is meant to touch, and its work."""
    air = df.example("figure-3-air").replace("experiment", approach("12 nm", "2 nm"))
    dmt_stiff = df.Case(
        cantilever={"f0": "350 kHz", "k": "40 N/m", "Q": 400}, drive={"A0": "30 nm"}, tip={"radius": "20 nm"},
        sample={"youngs_modulus": "1.2 GPa", "poisson_ratio": 0.3}, forces=[{"model": "dmt", "hamaker": "7.1e-20 J"}],
        experiment=approach("36 nm", "15 nm", direction="both"),
    )  # fmt: skip
    drag = {"model": "kelvin_voigt", "viscosity": "20 Pa s"}
    both = approach("24 nm", "8 nm", direction="both")
    h = df.Case(**STIFF, forces=[{"model": "dmt", "hamaker": "6e-20 J"}, drag], experiment=both)
    i = df.Case(**STIFF, forces=[{"model": "jkr", "surface_energy": "0.02 J/m^2"}], experiment=both)
    f = df.Case(**WATER, experiment=approach("11 nm", "2 nm"))
    f_drag = f.replace("forces", [{"model": "hertz"}, {"model": "kelvin_voigt", "viscosity": "5 Pa s"}])
    memory = {"model": "sls", "elements": 48, "instant_modulus": "50 MPa", "relaxed_modulus": "10 MPa"}
    bimodal = df.example("table-1-bimodal").replace("experiment", approach("11 nm", "4 nm"))

    def swept(case: df.Case, low: str, high: str) -> Callable[[], xr.Dataset]:
        return partial(df.sweep, case, moduli(low, high), workers=1)

    return {
        "a": (False, partial(df.run, air)), "c": (True, partial(df.run, dmt_stiff)),
        "g": (True, partial(df.run, df.example("hysteresis"))), "h": (True, partial(df.run, h)),
        "i": (True, partial(df.run, i)), "f": (True, partial(df.run, f)), "f with drag": (True, partial(df.run, f_drag)),
        "64 of h": (True, swept(h, "0.1 GPa", "10 GPa")), "64 of f": (True, swept(f, "5 MPa", "500 MPa")),
        "64 of f with drag": (True, swept(f_drag, "5 MPa", "500 MPa")),
        "f, 10,000 points": (True, partial(df.run, f.replace("experiment.zc.points", 10_000))),
        "bimodal": (True, partial(df.run, bimodal)),
        "f, 48 elements": (True, partial(df.run, f.replace("forces", [memory]))),
    }  # fmt: skip


def one_u() -> float:
    """Return the CPU time (s) of one RK4 period by hand, 128 samples over a Hertz contact."""
    cosine, sine = handwritten.tables(128)
    periods, best = 400, math.inf
    for _ in range(20):
        begin = time.process_time()
        handwritten.hertz(0.767, 1.0, 0.01, cosine, sine, 128, periods)
        best = min(best, time.process_time() - begin)
    return best / periods


class Clock:
    """CPU time (s) of a piece of work, and how much of it solved the curve: the rest is Dataset, advice and provenance."""

    def __init__(self, work: Callable[[], xr.Dataset]) -> None:
        solve, self.solving = PlannedCurve.solve, 0.0

        def timed(*arguments: Any) -> Any:
            begin = time.process_time()
            try:
                return solve(*arguments)
            finally:
                self.solving += time.process_time() - begin

        with mock.patch.object(PlannedCurve, "solve", timed):
            begin = time.process_time()
            whole(work())
            self.whole = time.process_time() - begin


def times(names: list[str]) -> int:
    """Print the CPU time of curves, a point, in u; fail a touching case that does not touch.

    "besides" is the part that does not depend on the solver, the least of the repeats.
    """
    cases, missed = timed_cases(), 0
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else os.cpu_count())
    print(f"{'case':20s} {'points':>7s} {'touching':>8s} {'ok':>6s} {'u a point':>9s} {'besides':>8s} {'u':>8s}")
    for name in names or cases:
        touching, work = cases[name]
        result, taken = whole(work()), list[Clock]()
        u = one_u()
        while len(taken) < 3 or (sum(one.whole for one in taken) < 1.0 and len(taken) < 20):
            taken.append(Clock(work))
        points = result.status.size
        besides = min(one.whole - one.solving for one in taken) / points / u
        share = float((result.max_indentation.values > 0.0).mean())
        ok = int((result.status.values == Status.OK).sum())
        wrong = touching and share < 0.5
        missed += wrong
        in_all = statistics.median(one.whole for one in taken) / points / u
        apart = f"{besides:8.1f}" if taken[0].solving else f"{'-':>8s}"  # a sweep solves its curves another way
        print(
            f"{name:20s} {points:7d} {share:8.0%} {ok:6d} {in_all:9.1f} {apart} {1e6 * u:5.2f} us"
            + ("  does not touch" if wrong else "")
        )
    return int(bool(missed))
