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
        **INSTRUMENTS[name], drive={"A0": A0}, sample={"youngs_modulus": modulus, "poisson_ratio": 0.3}, forces=forces
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


def result() -> xr.Dataset:
    """Return a fit made up by hand, for pictures and reports."""
    names, height = [E, "zc_offset"], np.linspace(10e-9, 2e-9, 12)
    point, both = "point", ("point", "tone")
    column = np.linspace(10e-9, 3e-9, 12)[:, None]
    values = {
        "value": [1e9, 1e-10], "error": [1e8, 1e-11], "error_low": [9e7, 1e-11], "error_high": [1.1e8, 1e-11],
        "error_given": [0.0, 0.0], "start": [2e9, 0.0], "prior": [np.nan, np.nan], "prior_error": [np.nan, np.nan],
    }  # fmt: skip
    out = xr.Dataset(
        {name: ("parameter", np.array(column)) for name, column in values.items()}
        | {"at_bound": ("parameter", np.zeros(2, bool)), "seen": ("parameter", np.ones(2, bool))}
        | {"correlation": (("parameter", "parameter_2"), np.array([[1.0, 0.9], [0.9, 1.0]]))}
        | dict.fromkeys(("height", "zc"), (point, height))
        | dict.fromkeys(("amplitude", "amplitude_fit"), (both, column))
        | dict.fromkeys(("phase", "phase_fit"), (both, 10000000000.0 * column))
        | {name: (both, np.zeros((12, 1))) for name in ("amplitude_residual", "phase_residual")}
        | {"used": (point, height > 3e-9), "lost": (point, height > 9.5e-9)},
        {
            "parameter": names, "parameter_2": names, "unit": ("parameter", ["Pa", "m"]), "tone": [1],
            "symbol": ("parameter", ["E_s", "z_0"]),
            "label": ("parameter", ["Young's modulus of the sample", "zc minus the measured height"]),
            "branch": (point, np.where(height > 6e-9, 1, -1)),
        },
        {
            "kind": "fit", "title": "made up", "chi2": 20.0, "degrees_of_freedom": 18, "aic": 24.0, "bic": 26.0,
            "lost_points": 1, "independence": 0.5, "points": 10, "amplitude_error": [1e-11], "phase_error": [0.3],
            "parameters": 2,
        },
    )  # fmt: skip
    out["amplitude"].attrs["units"] = out["zc"].attrs["units"] = "m"
    out["phase"].attrs["units"] = "degree"
    return out
