"""Samples known by name: each value has a source, and what is given beside the name comes first."""

import json

import pytest
from every import every
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app
from dforce.core.errors import ParameterError

HERTZ = {"cantilever": {"f0": "70 kHz", "k": 2, "Q": 200}, "drive": {"A0": "10 nm"}, "forces": [{"model": "hertz"}]}


@every(df.materials().items(), lambda item: item[0])
def test_what_is_shipped_has_a_source_and_a_modulus_within_its_range(name, material):
    assert len(material.source) > 20
    assert 100.0 < material.youngs_modulus < 1e12
    if material.low is not None:
        assert material.low <= material.youngs_modulus <= material.high
    if (
        material.hamaker is not None and material.hamaker_in_water is not None
    ):  # water lies between the two in all its optical properties
        assert material.hamaker_in_water < material.hamaker
    assert df.Sample(name=name).youngs_modulus == material.youngs_modulus


def test_two_materials_attract_by_the_geometric_mean_of_their_constants():
    polystyrene, glass, gel = (df.materials()[name] for name in ("polystyrene", "borosilicate_glass", "gel"))
    assert polystyrene.hamaker_with(polystyrene) == pytest.approx(polystyrene.hamaker)
    assert polystyrene.hamaker_with(glass) == pytest.approx(7.65e-20, rel=1e-3)
    assert glass.hamaker_with(polystyrene, "water") == pytest.approx(1.0817e-20, rel=1e-3)
    assert polystyrene.hamaker_with(gel) is None and polystyrene.hamaker_with(glass, "ethanol") is None


def test_a_name_gives_nominal_values_and_numbers_beside_it_come_first():
    case = df.Case(**HERTZ, tip={"radius": "7 nm"}, sample="polystyrene")
    assert case.sample.poisson_ratio == df.materials()["polystyrene"].poisson_ratio
    assert case.problem.forces[0].E_eff == pytest.approx(3e9 / (1 - 0.34**2))
    assert 'sample = "polystyrene"' in case.to_toml()
    assert df.Case.from_toml(case.to_toml()) == case
    assert df.Case.from_toml(case.to_toml(complete=True)).sample == case.sample
    softer = case.replace("sample.youngs_modulus", "2.4 GPa")
    assert softer.sample.youngs_modulus == 2.4e9
    assert softer.sample.poisson_ratio == 0.34
    assert df.Sample(name="pmma").poisson_ratio == df.Sample().poisson_ratio  # none has a source


@pytest.mark.parametrize(
    ("sample", "sentence"),
    [
        (
            "polystyrol",
            "sample = 'polystyrol' is not known: write youngs_modulus, or a name; did you mean 'polystyrene'?",
        ),
        ({"name": "pdms", "youngs_modulus": "-1 MPa"}, "sample.youngs_modulus = -1 MPa is not above 0 GPa"),
    ],
)
def test_an_unknown_material_is_met_with_the_nearest(sample, sentence):
    with pytest.raises(ParameterError) as error:
        df.Case(**HERTZ, sample=sample)
    assert sentence in str(error.value)


def test_the_command_shows_range_and_source():
    shown = CliRunner().invoke(app, ["materials", "polystyrene"])
    assert shown.exit_code == 0
    for text in ("2.3 GPa to 4.1 GPa", "65 zJ", "9 zJ", "Walstra"):
        assert text in shown.stdout
    assert CliRunner().invoke(app, ["materials", "PolyStyrene"]).stdout == shown.stdout
    told = json.loads(CliRunner().invoke(app, ["materials", "--json"]).stdout)
    assert {one["name"] for one in told} == set(df.materials())
    wrong = CliRunner().invoke(app, ["materials", "polystyren"])
    assert wrong.exit_code == 2
    assert "did you mean 'polystyrene'?" in wrong.stderr
