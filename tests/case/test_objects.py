"""What a case answers: a unit of another kind, an assignment, and how it is shown, copied and kept."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from every import every

import dforce as df
from dforce.core.errors import shorten
from dforce.core.units import parse, show

WRONG = "2 cd"  # a luminous intensity: no quantity of dForce is one
CASE = df.example("figure-3-air")
SECTIONS = {
    "cantilever": CASE.cantilever, "drive": CASE.drive, "tip": CASE.tip, "sample": CASE.sample, "contact": CASE.contact,
    "medium": CASE.medium, "experiment": CASE.experiment,
}  # fmt: skip
QUANTITIES = [
    (model, name)
    for model in (
        df.Cantilever, df.Mode, df.Beam, df.Drive, df.Tone, df.Tip, df.Sample, df.Contact, df.Medium,
        df.experiments.Grid, df.experiments.FrequencyGrid, df.experiments.Span, df.experiments.InitialMotion,
        *df.experiments.EXPERIMENTS.values(), *df.forces.REGISTRY.values(),
    )
    for name in model.quantities()
]  # fmt: skip


def missing(model, name):
    return model.model_fields[name].is_required()


@every(QUANTITIES)
def test_a_unit_of_another_kind_is_a_unit_error_in_every_class(model, name):
    needed = {
        other: 1e-9 if one.unit == "m" else min(1.0, one.bounds()[1])
        for other, one in model.quantities().items()
        if missing(model, other)
    }
    with pytest.raises(df.UnitError, match=rf"{name}(\.1)? is '2 cd'"):
        model(**{**needed, **model.example, name: WRONG})


@every(
    [
        lambda: df.Case(cantilever={"f0": WRONG, "k": 1.0, "Q": 100.0}, drive={"A0": "10 nm"}),
        lambda: CASE.replace("tip.radius", WRONG),
        lambda: CASE.replace(forces=[{"model": "dmt", "hamaker": WRONG}]),
        lambda: CASE.set(f"forces.dmt.hamaker={WRONG}"),
        lambda: CASE.tip.replace(radius=WRONG),
        lambda: df.approach(CASE, zc=["3 nm", WRONG]),
        lambda: df.approach(CASE, zc={"start": WRONG, "stop": "1 nm", "points": 3}),
        lambda: df.branches(CASE, zc=(WRONG, "1 nm")),
        lambda: df.branches(CASE, zc="5 nm", parameter="sample.youngs_modulus", start=WRONG, stop="2 GPa"),
        lambda: df.dwell(CASE, zc=WRONG),
        lambda: df.basins(CASE, zc=WRONG),
        lambda: df.frequency_sweep(CASE, frequency=[WRONG, "50 kHz"], zc="5 nm"),
        lambda: df.force_along(CASE, time=["0 s", WRONG], distance=[2e-9, 1e-9]),
        lambda: df.force_curve(CASE, distance=["3 nm", WRONG]),
        lambda: df.force_curve(CASE, speed=WRONG),
        lambda: df.force_curve(CASE, zc=WRONG),
        lambda: df.sweep(CASE, over={"tip.radius": ["1 nm", WRONG]}),
        lambda: df.plot.check_width(WRONG),
        lambda: parse(WRONG, "m"),
    ]
)
def test_a_unit_of_another_kind_is_a_unit_error_wherever_it_is_given(call):
    with pytest.raises(df.UnitError, match="2 cd"):
        call()


def test_the_path_of_a_quantity_of_a_force_is_told_once():
    with pytest.raises(df.UnitError, match=r"^forces\.dmt\.hamaker is '2 cd', which"):
        CASE.replace(forces=[{"model": "dmt", "hamaker": WRONG}])


@pytest.mark.parametrize(("name", "part"), [("case", CASE), *SECTIONS.items(), ("dmt", CASE.forces[0])])
def test_an_assignment_is_answered_with_what_to_do_instead(name, part):
    for key in part.keys():  # noqa: SIM118 the method of Parameters
        before = getattr(part, key)
        for change in (lambda key=key: setattr(part, key, 1.0), lambda key=key: delattr(part, key)):
            with pytest.raises(df.ParameterError) as error:
                change()
            assert str(error.value).startswith(f"{name}.{key} cannot be changed")
            assert f"replace({key}=...) gives a changed copy" in str(error.value)
        assert getattr(part, key) is before


def test_an_assignment_to_a_name_that_is_none_suggests_the_nearest():
    with pytest.raises(df.ParameterError, match="tip has no parameter 'radus'; did you mean 'radius'"):
        CASE.tip.radus = 1e-9


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda case: pickle.loads(pickle.dumps(case))])
def test_a_case_can_be_copied_and_kept_all_the_same(again):
    assert again(CASE) == CASE
    assert again(CASE).problem.tones == CASE.problem.tones


@pytest.mark.parametrize("name", list(df.examples()))
def test_a_case_is_told_in_a_line(name):
    case = df.example(name)
    text = repr(case)
    assert len(text) < 250 and "\n" not in text
    assert text.startswith("<Case '") and case.title[:40] in text
    assert all(show(mode.k, "N/m", 4) in text for mode in case.problem.modes)
    assert all(force.name in text for force in case.forces)


def test_a_long_title_is_shortened_in_the_line_of_a_case():
    assert len(repr(CASE.replace(title="a'\n" * 90))) < 250


def test_a_public_function_can_be_sent_to_another_process():
    """As ``multiprocessing`` and Dask do: by its name, under which the same object must be found."""
    for function in (df.run, df.sweep, df.advice, df.plot.overview):
        assert pickle.loads(pickle.dumps(function)) is function


def test_a_number_of_numpy_is_as_good_as_pythons():
    assert show(np.float64(2e-9), "m") == "2 nm"
    assert shorten("a" * 90, np.int64(10)) == "aaaaaaa..."
