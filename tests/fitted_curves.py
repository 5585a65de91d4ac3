"""The measured curves that dForce ships, and the cases that they were made with."""

from importlib.resources import files

import numpy as np
import xarray as xr

import dforce as df

INSTRUMENTS = {
    "stiff": {"cantilever": {"f0": 70e3, "k": 2.7, "Q": 180.0}, "tip": {"radius": 8e-9}},
    "air": {"cantilever": {"f0": 48.9e3, "k": 0.9, "Q": 255.0}, "tip": {"radius": 2e-9}},
    "liquid": {"cantilever": {"f0": 20e3, "k": 0.3, "Q": 3.0}, "tip": {"radius": 10e-9}},
}
TRUTH = {  # E, H, eta, height offset, A0, phase offset
    "stiff": (2e9, 6e-20, 20.0, 0.35e-9, 30e-9, 1.2),
    "air": (1e9, 2e-20, 20.0, -0.2e-9, 10e-9, 0.0),
    "liquid": (0.05e9, 1e-21, 5.0, 0.1e-9, 8e-9, -0.8),
}
SIGMA = {"stiff": (0.06e-9, 0.3), "air": (0.02e-9, 0.3), "liquid": (0.016e-9, 0.3)}
E, H, ETA = "sample.youngs_modulus", "forces.dmt.hamaker", "forces.kelvin_voigt.viscosity"


def case_of(name: str, viscous: bool = True) -> df.Case:
    """Return the case with which a curve was made, sampled as the reference values were."""
    modulus, hamaker, viscosity, _, A0, _ = TRUTH[name]
    forces = [df.forces.DMT(hamaker=hamaker)]
    if viscous:
        forces.append(df.forces.KelvinVoigt(viscosity=viscosity))
    return df.Case(
        **INSTRUMENTS[name],
        drive={"A0": A0},
        sample={"youngs_modulus": modulus, "poisson_ratio": 0.3},
        forces=forces,
    )


def data_of(name: str) -> xr.Dataset:
    """Return a shipped curve as `read_measured` gives it."""
    text = (files("dforce.library") / "measured" / f"{name}.csv").read_text()
    rows = np.array([list(map(float, line.split(","))) for line in text.splitlines() if not line.startswith("#")])
    return dataset(rows[:, 0] * 1e-9, rows[:, 1] * 1e-9, rows[:, 2], rows[:, 3], SIGMA[name])


def dataset(height, amplitude, phase, branch, sigma) -> xr.Dataset:
    """Return a measured curve from its columns."""
    columns = {"height": height, "amplitude": amplitude, "phase": phase, "branch": branch}
    return xr.Dataset(
        {name: ("point", np.asarray(values)) for name, values in columns.items()},
        attrs={"amplitude_error": sigma[0], "phase_error": sigma[1]},
    )
