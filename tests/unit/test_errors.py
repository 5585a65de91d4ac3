"""The hints in sentences about names."""

from __future__ import annotations

import pytest
import synthetic
import xarray as xr

import dforce as df
from dforce.core.errors import ChangedResultError, checked, nearest


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("figure3", "figure-3-air"), ("figure 3 water", "figure-3-water"), ("FIGURE-4", "figure-4-hard"),
        ("figure7", "figure-7-low"), ("figure-3-airr", "figure-3-air"), ("figur-6", "figure-6"),
        ("resonance", "resonance-curve"), ("table1bimodal", "table-1-bimodal"),
    ],
)  # fmt: skip
def test_the_name_that_begins_alike_is_suggested_before_one_of_like_length(name, meant):
    with pytest.raises(df.ParameterError, match=f"did you mean '{meant}'"):
        df.example(name)


def test_a_letter_or_two_begin_too_many_names_to_suggest_one():
    assert nearest("f", df.examples(), "dforce examples") == "; dforce examples lists all"


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("vdw", "'van_der_waals'"), ("KV", "'kelvin_voigt'"), ("LJ", "'lennard_jones'"), ("JKR", "'jkr'"),
        ("kelvin-voigt", "'kelvin_voigt'"), ("md", "'magnetic_dipole' or 'maugis_dugdale'"), ("waals", "'van_der_waals'"),
        ("EDL", "'dlvo'"), ("Debye", "'dlvo'"), ("Wiechert", "'generalized_maxwell'"), ("MFM", "'magnetic_dipole'"),
        ("Prony series", "'generalized_maxwell'"), ("Zener", "'sls' or 'sls_simple'"), ("meniscus", "'capillary'"),
    ],
)  # fmt: skip
def test_an_abbreviation_of_the_field_finds_its_model(name, meant):
    assert nearest(name, df.forces.REGISTRY) == f"; did you mean {meant}?"


@pytest.mark.parametrize(
    ("name", "known", "command"),
    [("xzq", df.forces.REGISTRY, "dforce models"), ("AC160", df.cantilevers(), "dforce cantilevers")],
)
def test_of_many_names_only_the_nearest_are_listed_and_the_command_that_lists_all(name, known, command):
    hint = nearest(name, known, command)
    assert hint.endswith(f"; {command} lists all")
    assert sum(other in hint for other in known) <= 3 and len(hint) < 120


@pytest.mark.parametrize(
    ("known", "kind"),
    [
        (df.forces.REGISTRY, "force model"), (df.examples(), "example"), (df.materials(), "material"),
        (df.cantilevers(), "cantilever"),
    ],
)  # fmt: skip
def test_a_list_by_name_answers_an_unknown_one_with_the_nearest(known, kind):
    name = next(iter(known))
    with pytest.raises(df.ParameterError) as refused:
        known[name + "x"]
    assert str(refused.value) == f"there is no {kind} '{name}x'; did you mean '{name}'?"
    with pytest.raises(KeyError):  # as of any dict
        known[name + "x"]
    assert known.get(name + "x") is None and name + "x" not in known


def test_each_other_name_of_a_model_finds_it():
    for model in df.forces.REGISTRY.values():
        for word in model.also_called:
            assert f"'{model.name}'" in nearest(word, df.forces.REGISTRY), word


def test_few_names_are_listed_all():
    assert nearest("zz", ["low", "high"]) == "; known: high, low"


def test_an_error_of_a_function_that_was_given_is_passed_on_as_it_is():
    @checked
    def work(result: xr.Dataset, progress):
        progress()
        return result["missing"]

    def fails():
        return {}["mine"]

    with pytest.raises(KeyError, match="mine"):
        work(synthetic.approach(), fails)
    with pytest.raises(ChangedResultError, match="missing"):
        work(synthetic.approach(), lambda: None)
