"""The likeliest mistakes in each number that a user types: a lost unit, percent for a share, degrees for radians."""

from __future__ import annotations

import numpy as np
import pytest
from every import every

import dforce as df
from dforce.core import units
from dforce.core.parameter_quantity import UTMOST
from dforce.core.parameters import Parameters, param
from dforce.experiments import EXPERIMENTS
from dforce.forces import REGISTRY
from dforce.maps.regime_map import shares_of

AIR = df.example("figure-3-air")
ZC = "experiment.zc"
MEANT = {
    # path, what was typed, the sentence
    "zc of a dwell": ("experiment", {"kind": "dwell", "zc": 4}, f"{ZC} = 4 m is above 1 mm; did you mean '4 nm'?"),
    "zc below the surface": ("experiment", {"kind": "dwell", "zc": -4}, f"{ZC} = -4 m is below -1 mm; did you mean '-4 nm'?"),
    "zc as text": ("experiment", {"kind": "dwell", "zc": "4"}, f"{ZC} = 4 m is above 1 mm; did you mean '4 nm'?"),
    "list of zc": ("experiment", {"kind": "approach", "zc": [12, 1]}, f"{ZC} = 12 m is above 1 mm; did you mean '12 nm'?"),
    "grid of zc": (
        "experiment", {"kind": "approach", "zc": {"start": 12, "stop": 1}},
        f"{ZC}.start = 12 m is above 1 mm; did you mean '12 nm'?",
    ),
    "shares in percent": (
        "experiment", {"kind": "approach", "zc": {"of": "drive.A0", "start": 115, "stop": 5}}, f"{ZC}.start = 115 is above 50",
    ),
    "span of branches": (
        "experiment", {"kind": "branches", "zc": [12, 1]}, f"{ZC} = 12 m is above 1 mm; did you mean '12 nm'?",
    ),
    "start": (
        "experiment", {"kind": "dwell", "zc": "5 nm", "start": {"amplitude": 5}},
        "experiment.start.amplitude = 5 m is above 1 mm; did you mean '5 nm'?",
    ),
    "phase of a start": (
        "experiment", {"kind": "dwell", "zc": "5 nm", "start": {"amplitude": "5 nm", "phase": 90}},
        "experiment.start.phase = 5156.62 deg is above 360 deg; did you mean '90 deg'?",
    ),
    "phases of basins": (
        "experiment", {"kind": "basins", "zc": "5 nm", "phase": {"start": 0, "stop": 351}},
        "experiment.phase.stop = 20110.8 deg is above 360 deg; did you mean '351 deg'?",
    ),
    "radius": ("tip.radius", 2, "tip.radius = 2 m is above 1 mm; did you mean '2 nm'?"),
    "free amplitude": ("drive.A0", 10, "drive.A0 = 10 m is above 1 mm; did you mean '10 nm'?"),
    "phase of the drive": ("drive.phase", 90, "drive.phase = 5156.62 deg is above 360 deg; did you mean '90 deg'?"),
    "tilt": ("cantilever.tilt", 11, "cantilever.tilt = 630.254 deg is above 60 deg; did you mean '11 deg'?"),
    "intermolecular distance": ("contact.a0", 0.165, "contact.a0 = 165 mm is above 10 nm; did you mean '0.165 nm'?"),
    "thickness": ("sample.thickness", 50, "sample.thickness = 50 m is above 1 m; did you mean '50 nm'?"),
    "Poisson's ratio": ("sample.poisson_ratio", 30, "sample.poisson_ratio = 30 is above 0.5; did you mean 0.3 or '30 %'?"),
    "Hamaker constant": ("forces.dmt.hamaker", 2, "forces.dmt.hamaker = 2 J is above 1000 aJ"),
    "surface energy": (
        "forces", [{"model": "jkr", "surface_energy": 30}],
        "forces.jkr.surface_energy = 30 J/m^2 is above 10 J/m^2; did you mean '30 mJ/m^2'?",
    ),
    "decay length": (
        "forces", [{"model": "hydration", "decay": 0.3}],
        "forces.hydration.decay = 300 mm is above 1 mm; did you mean '0.3 nm'?",
    ),
    "humidity": (
        "forces", [{"model": "capillary", "humidity": 50}],
        "forces.capillary.humidity = 50 is not below 1; did you mean 0.5 or '50 %'?",
    ),
    "force": (
        "forces", [{"model": "solvation", "amplitude": 1}],
        "forces.solvation.amplitude = 1 N is above 1 mN; did you mean '1 nN'?",
    ),
    "degrees Celsius": (
        "medium", {"name": "water", "temperature": 25},
        "medium.temperature = 25 K is too cold for water; did you mean '25 degC'?",
    ),
    "C for degC": (
        "medium", {"name": "water", "temperature": "25 C"},
        "medium.temperature is '25 C', which is a quantity in C, not a temperature (for example in degC)",
    ),
    "equal ends": (
        "experiment", {"kind": "approach", "zc": {"start": "5 nm", "stop": "0.005 um", "points": 9}},
        "experiment.zc has equal start and stop, so its 9 points are equal; change stop",
    ),
    "Q in percent": ("cantilever.Q", "255 %", "cantilever.Q is '255 %', but is not a share; write a number without %"),
    "sensitivity": ("readout", {"kind": "optical_lever", "invols": 60}, "readout.invols = 60 m/V is above 1 mm/V"),
    "detector": ("noise", {"detector": 100}, "noise.detector = 100 m/Hz^0.5 is above 1e-9 m/Hz^0.5"),
}  # fmt: skip


@every(MEANT)
def test_the_likeliest_mistake_is_met_with_what_was_meant(name):
    path, given, sentence = MEANT[name]
    with pytest.raises(df.ParameterError) as raised:
        AIR.replace(path, given)
    assert str(raised.value).startswith(sentence)


def test_meters_are_not_taken_for_nanometers():
    with pytest.raises(df.ParameterError, match=r"^contact\.a0 = 16\.5 nm is above 10 nm$"):
        AIR.replace("contact.a0", 1.65e-8)


def test_meters_for_nanometers_are_refused_before_anything_is_computed():
    with pytest.raises(df.ParameterError, match=f"{ZC} = 12 m is above 1 mm; did you mean '12 nm'"):
        df.approach(AIR, zc=np.linspace(12, 1, 10))
    with pytest.raises(df.ParameterError, match=r"tip\.radius = 2 m is above 1 mm; did you mean '2 nm'"):
        df.sweep(AIR, over={"tip.radius": [1e-9, 2]})


def test_every_length_angle_energy_and_force_has_an_end():
    """A number of a unit with an utmost size is refused beyond it in every model, those of plug-ins included."""

    class OfAPlugIn(Parameters):
        length: float = param("1 nm", doc="a length")

    models = [*REGISTRY.values(), *EXPERIMENTS.values(), OfAPlugIn]
    tried = 0
    for model in models:
        for quantity in model.quantities().values():
            if quantity.unit in UTMOST:
                tried += 1
                with pytest.raises(df.ParameterError, match=r"is (not )?(above|below)"):
                    quantity.check(1e6 * UTMOST[quantity.unit])
                with pytest.raises(df.ParameterError, match=r"is (not )?(above|below)"):
                    quantity.check(-1e6 * UTMOST[quantity.unit])
    assert tried > 30


SHARES = [
    (0.8, 0.8), ("0.8", 0.8), ("80 %", 0.8), ("80%", 0.8), (1, 1.0), ("100 %", 1.0),
]  # fmt: skip
NO_SHARES = [
    (80, "= 80 is above 1; did you mean 0.8 or '80 %'?"), ("80", "= 80 is above 1; did you mean 0.8 or '80 %'?"),
    (0, "= 0 is not above 0"), (-0.5, "= -0.5 is not above 0"), ("-80 %", "= -80 % is not above 0"),
    (800, "= 800 is above 1"), ("80 nm", "is '80 nm', which is a length, not a plain number"), ("most", "is 'most'"),
    (float("nan"), "is nan, which is not a finite number"),
]  # fmt: skip


@pytest.mark.parametrize(("given", "share"), SHARES)
def test_a_share_is_taken_in_percent_too(given, share):
    assert units.parse_share(given, "set_point") == share


@pytest.mark.parametrize(("given", "sentence"), NO_SHARES)
def test_a_set_point_that_is_no_share_is_met_with_what_was_meant_wherever_it_is_given(given, sentence):
    ways = {
        "set_point": lambda: df.at_set_point(df.approach(AIR, zc=["9 nm", "8 nm"]), given),
        "at_set_point": lambda: df.sweep(AIR, over={"tip.radius": ["2 nm"]}, at_set_point=given),
        "set_points": lambda: shares_of([given]),
    }
    for name, way in ways.items():
        with pytest.raises(df.ParameterError) as raised:
            way()
        assert str(raised.value).startswith(f"{name} {sentence}")


def test_set_points_are_taken_in_percent():
    assert list(shares_of(["80 %", 0.5, "90%"])) == [0.5, 0.8, 0.9]
    assert list(shares_of("80 %")) == [0.8]
    assert list(shares_of({"start": "50 %", "stop": 0.6, "points": 2})) == [0.5, 0.6]
    for wrong in (1.0, [0.5, 1]):
        with pytest.raises(df.ParameterError, match="set_points contains 1, which is not between 0 and 1"):
            shares_of(wrong)


def test_the_states_at_80_percent_are_those_at_a_share_of_080():
    found = df.approach(AIR, zc=["11 nm", "9 nm", "8 nm", "7 nm"])
    assert df.at_set_point(found, "80 %").identical(df.at_set_point(found, 0.8))
