"""Periodic orbits on the engine: held against those of RK4, whose errors are known to be below 1e-4."""

import numpy as np
import pytest
from tiers import some_long

import dforce as df
from dforce.solvers.engine_block import EngineBlock

STIFF = {
    "cantilever": {"f0": "300 kHz", "k": "40 N/m", "Q": 400},
    "drive": {"A0": "20 nm"},
    "tip": {"radius": "10 nm"},
    "sample": {"youngs_modulus": "2 GPa", "poisson_ratio": 0.3},
}
SOFT = STIFF | {
    "cantilever": {"f0": "30 kHz", "k": "0.5 N/m", "Q": 2},
    "drive": {"A0": "10 nm"},
    "sample": {"youngs_modulus": "50 MPa", "poisson_ratio": 0.3},
}
DMT = {"model": "dmt", "hamaker": "6e-20 J"}
OVER_TWO_FOLDS = {"kind": "approach", "direction": "both", "zc": {"start": "24 nm", "stop": "8 nm", "points": 17}}
CASES = {
    "Hertz in water": SOFT
    | {"forces": [{"model": "hertz"}], "experiment": {"kind": "approach", "zc": ["11 nm", "8 nm", "5 nm"]}},
    "DMT, there and back": STIFF | {"forces": [DMT], "experiment": OVER_TWO_FOLDS},
    "DMT and drag": STIFF
    | {"forces": [DMT, {"model": "kelvin_voigt", "viscosity": "20 Pa s"}], "experiment": OVER_TWO_FOLDS},
    "JKR, with a branch": STIFF
    | {
        "forces": [{"model": "jkr", "surface_energy": "0.02 J/m^2"}],
        "experiment": {"kind": "approach", "zc": ["22 nm", "17 nm"]},
    },
    "adhesion hysteresis, which switches where the tip turns": STIFF
    | {
        "forces": [{"model": "adhesion_hysteresis"}, {"model": "hertz"}],
        "experiment": {"kind": "approach", "zc": ["22 nm", "17 nm"]},
    },
    "frequencies": STIFF
    | {
        "forces": [DMT],
        "experiment": {"kind": "frequency_sweep", "zc": "30 nm", "frequency": ["299 kHz", "300 kHz", "301 kHz"]},
    },
    "a dwell": STIFF | {"forces": [DMT], "experiment": {"kind": "dwell", "zc": "17 nm"}},
}


def test_a_state_is_followed_in_fewer_orbits_than_twice_its_values(monkeypatch):
    """Steps that fell short again and again took 100 orbits a value here."""
    find, sought = EngineBlock.find, []

    def counted(self, which, *rest):
        sought.append(len(which))
        assert sum(sought) < 2 * curve["points"] * 2
        return find(self, which, *rest)

    monkeypatch.setattr(EngineBlock, "find", counted)
    curve = OVER_TWO_FOLDS["zc"] | {"points": 201}
    soft = STIFF["sample"] | {"youngs_modulus": 1e8 * 100.0 ** (12 / 63)}
    drag = {"model": "kelvin_voigt", "viscosity": "20 Pa s"}
    case = df.Case(**STIFF | {"sample": soft}, forces=[DMT, drag], solver={"integrator": "engine"})
    found = df.run(case.replace("experiment", OVER_TWO_FOLDS | {"zc": curve}))
    assert (found.status == 0).all()


@pytest.mark.parametrize("name", some_long(CASES, ["DMT and drag"]))
def test_the_engine_finds_the_orbits_of_rk4(name):
    plain, found = (
        df.run(df.Case(**CASES[name], solver={"integrator": integrator})) for integrator in ("rk4", "engine")
    )
    assert (found["status"].values == 0).all()
    np.testing.assert_allclose(found["multiplier_modulus"], plain["multiplier_modulus"], atol=1e-3)
    A0 = float(plain.attrs.get("A0", 20e-9))
    assert np.abs(found["amplitude"].values - plain["amplitude"].values).max() < 1e-4 * A0
    for force in ("peak_force", "min_force", "mean_force"):
        largest = np.abs(plain["peak_force"].values) + np.abs(plain["min_force"].values)
        assert (np.abs(found[force].values - plain[force].values) < 2e-4 * largest + 1e-15).all()
    energy = np.pi * 40.0 * (20e-9) ** 2 / 400.0
    assert np.abs(found["dissipated_energy"].values - plain["dissipated_energy"].values).max() < 2e-4 * energy


def test_the_engine_locates_the_jumps_of_rk4():
    case = df.Case(**CASES["DMT, there and back"])
    plain, found = (df.run(case.replace("solver.integrator", integrator)) for integrator in ("rk4", "engine"))
    assert found.sizes["jump"] == plain.sizes["jump"] > 0
    np.testing.assert_allclose(found["jump_zc"], plain["jump_zc"], atol=1e-4 * 20e-9)


def test_the_engine_says_which_memory_it_does_not_follow():
    sls = {"model": "sls", "instant_modulus": "50 MPa", "relaxed_modulus": "10 MPa"}
    case = df.Case(**SOFT, forces=[sls], solver={"integrator": "engine"}, experiment={"kind": "dwell", "zc": "9 nm"})
    with pytest.raises(df.ParameterError, match="no periodic orbit with the memory of sls"):
        df.run(case)
