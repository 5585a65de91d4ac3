"""Results made by formulas rather than by a run, for tests of files, pictures and the command line."""

from __future__ import annotations

import numpy as np
import xarray as xr

from dforce.results.dataset import describe
from dforce.results.provenance import provenance
from dforce.results.status import Status

CASE = """\
title = "Synthetic, in air"

[cantilever]
f0 = "48.9 kHz"
k = "0.9 N/m"
Q = 100

[drive]
A0 = "10 nm"

[tip]
radius = "2 nm"
"""
HAMAKER, RADIUS, A0 = 2e-20, 2e-9, 0.165e-9


def dmt(d):
    """Force of the DMT model at distances d."""
    depth = np.clip(A0 - d, 0.0, None)
    return -HAMAKER * RADIUS / (6 * np.maximum(d, A0) ** 2) + 4 / 3 * 1.1e9 * np.sqrt(RADIUS) * depth**1.5


def approach(points=111, directions=("approach", "retract"), tones=1, spoiled=True):
    """Curves whose attractive and repulsive branches change places at different distances."""
    zc = np.linspace(12e-9, 1e-9, points)
    free = 10e-9
    branches = {}
    for direction, jump in (("approach", 7.2e-9), ("retract", 9.6e-9)):
        attractive = zc > jump
        amplitude = np.minimum(free * 0.9995, np.where(attractive, zc - 0.35e-9, zc + 0.02e-9))
        lag = np.degrees(np.arcsin(amplitude / free))
        branches[direction] = amplitude, np.where(attractive, 180.0 - lag, lag), attractive
    data = {}

    def put(name, function, dims=("zc",)):
        values = np.stack([function(*branches[d]) for d in directions], axis=0)
        data[name] = (("direction", *dims), values)

    put("amplitude", lambda a, p, s: np.stack([a * 0.2**j for j in range(tones)], -1), ("zc", "tone"))
    put("phase", lambda a, p, s: np.stack([p + 7.0 * j for j in range(tones)], -1), ("zc", "tone"))
    put("mean_deflection", lambda a, p, s: np.where(s, -2e-12, 15e-12 * (free - a) / free))
    put("peak_force", lambda a, p, s: np.where(s, 0.0, 2.2e-10 * np.sqrt(1.1 - a / free)))
    put("min_force", lambda a, p, s: np.where(s, -6e-11, -2.4e-10))
    put("max_indentation", lambda a, p, s: np.where(s, 0.0, 0.22e-9))
    put("contact_time", lambda a, p, s: np.where(s, 0.0, 1.4e-6))
    put("contact_fraction", lambda a, p, s: np.where(s, 0.0, 0.07))
    put("total_dissipated_energy", lambda a, p, s: np.where(s, 0.0, 3.4e-19))
    put("virial", lambda a, p, s: np.stack([-1e-18 * np.cos(np.radians(p))], -1), ("zc", "mode"))
    put("status", lambda a, p, s: np.full(points, Status.OK, dtype=np.int8))
    coords = {"zc": zc, "direction": np.array(directions), "tone": np.arange(1, tones + 1), "mode": [1]}
    dataset = xr.Dataset(data, coords)
    if spoiled:
        dataset["status"][0, [20, 21]] = Status.NOT_SETTLED
        dataset["status"][0, 40] = Status.FAILED
        for variable in dataset.data_vars.values():
            if variable.dtype.kind == "f":
                variable[0, 40] = np.nan
    if len(directions) == 1:
        dataset = dataset.isel(direction=0, drop=True)
    dataset.attrs.update(provenance(CASE, "Synthetic, in air"), interrupted=False, seconds=1.25, solves=3)
    return describe(dataset)


def dwell(zc=4e-9, amplitude=4.05e-9, phase=54.2, periods=8, samples=256, f0=48.9e3):
    """Traces of a tapping tip, its force and a spectrum with harmonics."""
    time = np.arange(periods * samples) / (samples * f0)
    turn = 2 * np.pi * f0 * time
    deflection = 15e-12 + amplitude * np.cos(turn - np.radians(phase)) + 8e-12 * np.cos(2 * turn + 0.3)
    velocity = -2 * np.pi * f0 * amplitude * np.sin(turn - np.radians(phase))
    distance = zc + deflection
    force = dmt(distance)
    frequency = np.fft.rfftfreq(len(time), time[1])
    spectrum = 2 * np.abs(np.fft.rfft(deflection + 2e-11 * force / 1e-10)) / len(time)
    keep = frequency < 11 * f0
    dataset = xr.Dataset(
        {
            "amplitude": ("tone", [amplitude]),
            "phase": ("tone", [phase]),
            "harmonic_amplitude": ("harmonic", amplitude * 0.01 ** np.arange(4)),
            "mean_deflection": 15e-12,
            "peak_force": force.max(),
            "min_force": force.min(),
            "max_indentation": max(A0 - distance.min(), 0.0),
            "contact_time": 2.1e-6,
            "contact_fraction": float((distance < A0).mean()),
            "virial": ("mode", [-7.4e-19]),
            "dissipated_energy": ("mode", [2e-20]),
            "total_dissipated_energy": 2.1e-20,
            "status": np.int8(Status.OK),
            "deflection": ("time", deflection),
            "velocity": ("time", velocity),
            "distance": ("time", distance),
            "force": ("time", force),
            "indentation": ("time", np.clip(A0 - distance, 0.0, None)),
            "mode_deflection": (("mode", "time"), deflection[None]),
            "spectrum": ("frequency", spectrum[keep]),
        },
        {"zc": zc, "time": time, "frequency": frequency[keep]} | {"tone": [1], "mode": [1], "harmonic": range(1, 5)},
    )
    dataset.attrs.update(provenance(CASE, "Synthetic dwell"))
    return describe(dataset)


def force_curve(hysteresis=True, points=400):
    """A force against distance; the retract keeps a neck up to 0.6 nm where there is hysteresis."""
    distance = np.linspace(2e-9, -0.6e-9, points)
    approach = dmt(distance)
    retract = np.where(hysteresis & (distance < 0.6e-9), approach - 1.5e-10, approach)
    dataset = xr.Dataset(
        {"force": (("direction", "distance"), np.stack([approach, retract]))},
        {"distance": distance, "direction": np.array(["approach", "retract"])},
    )
    dataset.attrs.update(provenance(CASE, "Synthetic force"))
    return describe(dataset)


def grid() -> xr.Dataset:
    """Return a sweep over a modulus, by equal factors, and a free amplitude."""
    modulus, A0 = np.geomspace(1e8, 1e10, 9), np.linspace(5e-9, 15e-9, 6)
    force = 1e-9 * (modulus[:, None] / 1e9) ** 0.5 * (A0[None] / 1e-8)
    words = {"units": "Pa", "long_name": "Young's modulus", "symbol": "E"}
    variables = {
        "peak_force": (("youngs_modulus", "A0"), force),
        "phase": (
            ("youngs_modulus", "A0", "tone"),
            (90.0 + 20.0 * np.log10(modulus / 1e9)[:, None] + 0.0 * A0)[..., None],
        ),
        "virial": (("youngs_modulus", "A0", "mode"), (force - force.mean())[..., None]),
    }
    coords = {
        "youngs_modulus": ("youngs_modulus", modulus, words),
        "A0": ("A0", A0, {"units": "m", "long_name": "free amplitude"}),
    }
    return describe(xr.Dataset(variables, coords, {"over": "sample.youngs_modulus drive.A0", "title": "a map"}))
