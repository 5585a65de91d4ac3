"""What completion and `help` show, and what a call that cannot be is answered."""

import inspect
import pydoc
import types

import pydantic
import pytest
from every import every

import dforce as df

CASE = df.example("figure-3-air")
CLASSES = [df.Tip, df.Cantilever, df.Drive, df.Sample, df.Case, df.SolverSettings, *df.forces.REGISTRY.values()]


@every([CASE, CASE.tip, CASE.forces[0], CASE.experiment, CASE.solver], lambda one: type(one).__name__)
def test_completion_shows_fields_and_nothing_of_pydantic(one):
    shown = set(dir(one))
    assert set(type(one).keys()) <= shown
    of_pydantic = {name for name in dir(pydantic.BaseModel) if not name.startswith("__")}
    assert not (shown & of_pydantic) - set(type(one).keys())


def test_completion_of_the_forces_shows_no_modules():
    assert not [name for name in dir(df.forces) if isinstance(getattr(df.forces, name), types.ModuleType)]
    assert "DMT" in dir(df.forces)


@every(CLASSES, lambda model: model.__name__)
def test_a_signature_names_the_kinds_that_are_taken(model):
    parameters = inspect.signature(model).parameters
    assert list(parameters) == model.keys()
    for name, quantity in model.quantities().items():
        if name in parameters:
            assert "float" not in str(parameters[name].annotation)
            assert quantity.unit == "1" or "Number" not in str(parameters[name].annotation)


def test_the_help_of_a_class_fits_on_a_page():
    text = pydoc.render_doc(df.Tip, renderer=pydoc.plaintext)
    assert len(text.splitlines()) < 70  # Python 3.13 gives each parameter a line of its own
    assert "radius: Length = None" in text


@pytest.mark.parametrize(
    "function", [df.approach, df.dwell, df.branches, df.frequency_sweep, df.basins, df.fit, df.fit_many]
)
def test_the_settings_of_a_function_are_named_in_its_signature(function):
    parameters = inspect.signature(function).parameters
    assert not [one for one in parameters.values() if one.kind is one.VAR_KEYWORD]
    of_fits = function.__name__.startswith("fit")
    model = (
        df.Case.model_fields["fit"].annotation.__args__[0] if of_fits else df.experiments.EXPERIMENTS[function.__name__]
    )
    keys = set(model.keys()) - {"kind"}
    assert keys <= set(parameters)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: df.Tip("2 nm"), "Tip takes its parameters by name: write Tip(radius='2 nm')"),
        (lambda: df.Sample("polystyrene"), "write Sample(name='polystyrene')"),
        (lambda: df.forces.DMT(1e-20), "write DMT(hamaker=1e-20)"),
        (lambda: df.approach(CASE, "5 nm", True, 2), "approach takes at most 3 arguments without their names"),
        (lambda: df.approach(CASE, direcion="both"), "approach has no argument 'direcion'; did you mean 'direction'?"),
        (lambda: df.run(), "run needs the argument 'case'"),
        (lambda: df.run(CASE, progres=True), "did you mean 'progress'?"),
        (lambda: df.forces.DMT(gamma=0.03), "write surface_energy = gamma, half of the work of adhesion W = 2 gamma"),
        (lambda: df.Drive(A0=["10 nm", "1 nm"]), "several tones are tables [[drive.tones]]"),
        (lambda: df.Drive(tones={"A0": "1 nm"}), "is not a list; write [[drive.tones]] in a file"),
        (lambda: df.Drive(A0="1 nm", kind="acoustic"), 'write excitation = "base" for a shaken base'),
        (lambda: CASE.replace(drive=[{"A0": "1 nm"}]), "drive is a list; several tones are tables [[drive.tones]]"),
        (lambda: df.Case(tones=[], drive={"A0": 1e-9}, cantilever="FMR"), "write [[drive.tones]]"),
    ],
)
def test_a_call_that_cannot_be_is_answered_with_what_to_write(call, sentence):
    with pytest.raises(df.ParameterError) as error:
        call()
    assert sentence in str(error.value)
