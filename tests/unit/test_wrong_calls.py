"""A call with a wrong kind of argument is answered with one sentence of dForce's own, whichever function it is."""

from __future__ import annotations

import contextlib
import importlib
import inspect
import types
from pathlib import Path

import fitted_curves
import matplotlib.pyplot as plt
import measured_curve
import numpy as np
import pytest
import synthetic
import xarray as xr
from every import every

import dforce as df
from dforce.core import argument_kinds as kinds

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

TEXT = synthetic.CASE + '\n[experiment]\nkind = "approach"\nzc = { start = "9 nm", stop = "8 nm", points = 3 }\n'
CASE = df.Case.from_toml(TEXT)
CURVE, TRACES = synthetic.approach(), synthetic.dwell()
WAYS = {"case": CASE, "zc": "8 nm"}
MOST_CHARACTERS = 1000  # of a sentence that lists all known names
LONG = (
    "approach",
    "frequency_sweep",
    "noisy_motion",
    "reconstruct",
    "safe_settings",
    "switching_rate",
    "thermal_spectrum",
    "checks.benchmark:benchmark",
    "checks.validation:validate",
)  # run for minutes where an argument is right after all

# An allowed call of each function; each argument in turn is then replaced by something wrong.
CALLS = {
    "advice": {"case": CASE, "result": CURVE},
    "answer": {"result": CURVE},
    "validity:advice_in": {"result": CURVE},
    "approach": WAYS,
    "at_set_point": {"result": CURVE, "set_point": 0.8, "names": ["phase"]},
    "basins": WAYS | {"amplitude": ["1 nm"], "phase": ["0 deg"]},
    "checks.benchmark:benchmark": {},
    "branches": {"case": CASE, "zc": ("12 nm", "11 nm")},
    "case:case_schema": {},
    "check_force": {"model": df.forces.Hertz},
    "core.files:check_target": {"path": "x.nc"},
    "results.status:count_status": {"dataset": CURVE},
    "results.curves:drawable": {"dataset": CURVE},
    "compare_fits": {"fits": {"one": fitted_curves.result(), "other": fitted_curves.result()}},
    "dwell": WAYS,
    "example": {"name": "figure-3-air"},
    "examples": {},
    "file_head": {"path": "curve.csv"},
    "chi2_in_words": {"result": fitted_curves.result()},
    "fit": {"case": CASE, "data": fitted_curves.data_of("air").isel(point=slice(8)), "free": [fitted_curves.H]},
    "fit_again": {"result": fitted_curves.result()},
    "fit_many": {"case": CASE, "curves": {}, "free": [fitted_curves.H]},
    "fit_report": {"result": fitted_curves.result()},
    "identify": {"case": CASE, "zc": ("12 nm", "11 nm"), "free": [fitted_curves.H], "helps": False},
    "identify_in_words": {"result": xr.Dataset()},
    "identify_report": {"result": xr.Dataset()},
    "core.notation:first_sentence": {"docstring": "One."},
    "force_along": {"case": CASE, "time": [0.0, 1.0, 2.0], "distance": [3e-9, 2e-9, 1e-9]},
    "force_curve": {"case": CASE, "distance": [3e-9, 2e-9]},
    "force_parts": {"result": synthetic.force_curve()},
    "frequency_sweep": {"case": CASE, "frequency": ["48 kHz", "49 kHz"], "zc": "8 nm"},
    "results.curves:goes_along": {"dataset": CURVE},
    "core.notation:html_symbol": {"latex": "E"},
    "results.curves:lines_of": {"dataset": CURVE, "x": "zc", "y": "phase"},
    "core.log:listening": {"listener": print},
    "load_case": {"path": "case.toml"},
    "load_plugin": {"path": "my_force.py"},
    "motion_at": {"point": CURVE},
    "core.errors:nearest": {"name": "a", "known": ["b"]},
    "load_plan": {"path": "plan.toml"},
    "noise": {"curve": CURVE, "bandwidth": "1 kHz"},
    "noisy_motion": {"case": CASE, "zc": "8 nm", "seeds": 2, "periods": 10},
    "param": {"default": "1 nm", "doc": "a length"},
    "parse": {"given": "1 nm", "unit": "m"},
    "results.curves:pictures_of": {"dataset": CURVE},
    "core.notation:plain_math": {"latex": "E"},
    "plan": {"case": CASE, "vary": {"tip.radius": ["2 nm"]}, "set_points": [0.8]},
    "read": {"path": "x.nc"},
    "results.dataset:reader_unit": {"variable": CURVE["zc"]},
    "findings.set_point:regime": {"point": CURVE.isel(zc=0, direction=0)},
    "calibrate": {"data": measured_curve.dataset()},
    "energy": {"data": df.calibrate(measured_curve.dataset(), thermal={"k": 2.0, "Q": 100})},
    "read_curves": {"path": "curve.csv"},
    "read_measured": {"path": "curve.csv"},
    "material": {"curve": CURVE},
    "reconstruct": {"curve": CURVE},
    "thermal_tune": {"spectrum": "thermal.csv"},
    "regimes": {"case": CASE, "over": {"tip.radius": ["2 nm", "3 nm"]}, "set_points": [0.8]},
    "report": {"result": CURVE},
    "results.significance:error_of": {"dataset": CURVE, "name": "phase"},
    "results.significance:is_none": {"dataset": CURVE, "name": "phase"},
    "results.significance:largest_error": {"dataset": CURVE, "name": "phase"},
    "results.curves:row_of": {"dataset": CURVE, "name": "phase"},
    "run": {"case": CASE},
    "safe_settings": {"result": CASE},
    "save_case": {"case": CASE, "path": "saved.toml"},
    "shared": {"path": "tip.radius"},
    "core.errors:shorten": {"value": "text"},
    "show": {"value": 1e-9, "unit": "m"},
    "core.units:split_unit": {"text": "1 nm"},
    "summary": {"dataset": CURVE},
    "sweep": {"case": CASE, "over": {"tip.radius": ["2 nm"]}},
    "core.units:unit_choices": {"unit": "m"},
    "snap_in_rate": {"case": CASE, "zc": "8 nm"},
    "snap_in_distance": {"case": CASE, "speed": "1 um/s"},
    "switching_rate": {"state": CURVE, "other": CURVE, "lanes": 2, "periods": 10},
    "thermal_spectrum": {"case": CASE, "duration": "1 ms"},
    "core.notation:unmarked": {"text": "one"},
    "core.units:usual_unit": {"unit": "m"},
    "checks.validation:validate": {},
    "checks.validation:validation_page": {"result": {}},
    "instrument.shared:values_used": {"models": [df.forces.Hertz]},
    "core.files:write_whole": {"path": "whole.txt", "content": b"whole"},
    "write": {"dataset": CURVE, "path": "x.nc"},
    "plot.amplitude_phase": {"dataset": CURVE},
    "plot.basins": {"dataset": CURVE},
    "plot.branches": {"dataset": CURVE},
    "plot.check_width": {"width": "85 mm"},
    "plot.curve": {"dataset": CURVE, "names": "phase"},
    "plot.draw": {"results": CURVE},
    "plot.fit": {"result": fitted_curves.result()},
    "plot.fit_errors": {"result": fitted_curves.result()},
    "plot.force_curve": {"dataset": synthetic.force_curve()},
    "plot.force_distance": {"dataset": TRACES},
    "plot.map": {"dataset": synthetic.grid(), "x": "A0", "y": "youngs_modulus", "quantity": "peak_force"},
    "plot.measured": {"dataset": measured_curve.dataset()},
    "plot.overview": {"dataset": CURVE},
    "plot.phase_portrait": {"dataset": TRACES},
    "plot.plan": {"dataset": CURVE},
    "plot.reconstruction": {"dataset": CURVE},
    "plot.resonance": {"dataset": CURVE},
    "plot.save": {"axes": plt.figure().subplots(), "path": "x.png"},
    "plot.spectrum": {"dataset": TRACES},
    "plot.thermal_spectrum": {"dataset": CURVE},
    "plot.traces": {"dataset": TRACES},
    "Case.from_toml": {"text": TEXT},
    "Case.quantity": {"self": CASE, "path": "tip.radius"},
    "Case.replace": {"self": CASE, "path": "tip.radius", "value": "3 nm"},
    "Case.to_python": {"self": CASE, "name": "result"},
    "Case.to_toml": {"self": CASE},
}
WRONG = (
    1, -1.5, float("nan"), "text", "", b"bytes", None, True, [], [1], ["text"], (None,), {}, {1: 2}, object(), print, int,
    np.arange(3.0), CASE, CASE.tip, CURVE, TRACES, xr.Dataset(), xr.DataArray([1.0]), plt.Figure(), df.forces.Hertz,
)  # fmt: skip


def public():
    """The functions that the package exports, some of its modules', and the methods of a case that a user calls, by name."""
    found = {name: getattr(df, name) for name in dir(df)}
    for name in CALLS:
        if ":" in name:
            module, _, function = name.partition(":")
            found[name] = getattr(importlib.import_module(f"dforce.{module}"), function)
    found |= {f"plot.{name}": getattr(df.plot, name) for name in df.plot.__all__}
    found |= {f"Case.{name}": value for name, value in inspect.getmembers(df.Case) if name in vars(df.Case)}
    return {
        name: value
        for name, value in found.items()
        if isinstance(value, types.FunctionType | types.MethodType) or hasattr(value, "__wrapped__")
        if not name.split(".")[-1].startswith("_")
    }


FUNCTIONS = public()
APART = {"Case.set", "Case.root"}  # takes any number of texts, see below; asked by messages


def test_every_public_function_with_an_argument_is_tried():
    takes_one = {name for name, function in FUNCTIONS.items() if inspect.signature(function).parameters}
    assert takes_one - APART <= set(CALLS) <= set(FUNCTIONS)


def answer(function, arguments):
    """Return what a call answers: nothing, a sentence of dForce, or the error of another kind."""
    try:
        given = function(**arguments)
        if isinstance(given, contextlib.AbstractContextManager) and not isinstance(given, Path):
            with given:
                pass
        elif isinstance(given, types.GeneratorType):
            list(given)
    except (df.DForceError, FileExistsError) as error:
        return str(error)
    except Exception as error:  # of any kind: that is the claim  # noqa: BLE001
        return error
    return ""


@pytest.mark.long
@every(CALLS)
def test_a_wrong_argument_is_answered_with_one_sentence(name, workdir):
    df.save_case(CASE, "case.toml")
    Path("curve.csv").write_text(measured_curve.text())
    Path("thermal.csv").write_text(measured_curve.spectrum_text())
    function, right, wrong = FUNCTIONS[name], CALLS[name], []
    allowed = kinds.taken(getattr(function, "__func__", function))
    for argument, parameter in inspect.signature(function).parameters.items():
        if parameter.kind is parameter.VAR_KEYWORD or argument == "self":
            continue
        for given in WRONG:
            fits = not allowed[argument] or any(kind.fits(given) for kind in allowed[argument])
            if fits and name in LONG:
                continue
            plt.close("all")
            said = answer(function, right | {argument: given})
            if isinstance(said, Exception):
                wrong.append(f"{name}({argument}={kinds.as_text(given)}): {type(said).__name__}: {said}")
            elif not fits and not said:
                wrong.append(f"{name}({argument}={kinds.as_text(given)}) is accepted")
            elif "\n" in said or len(said) > MOST_CHARACTERS:
                wrong.append(f"{name}({argument}={kinds.as_text(given)}): no short sentence: {said}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: df.dwell("figure-3-air", "5 nm"), "case = 'figure-3-air' is not a case; get a case from df.example or "
                                                   "df.load_case"),
        (lambda: df.advice(1), "case = 1 is neither a case nor a result; get a case from df.example or df.load_case; "
                               "get a result from df.run or df.read"),
        (lambda: df.calibrate({}), "data = {} is not a result; df.read_measured reads a measured curve "
         "from a file; pandas writes one by .to_csv('curve.csv', index=False)"),
        (lambda: df.write({}, "x.nc"), "dataset = {} is not a result; get a result from df.run or df.read"),
        (lambda: df.run(CASE, progress="yes"), "progress = 'yes' is neither a function nor True or False"),
        (lambda: CASE.set("drive.A0=9 nm", 2), "assignments = 2 is not text"),
    ],
)  # fmt: skip
def test_the_sentence_says_what_is_wanted_and_where_it_comes_from(call, sentence):
    with pytest.raises(df.ParameterError) as error:
        call()
    assert str(error.value) == sentence


def test_progress_is_the_same_argument_wherever_it_is_that_of_run():
    wanted = inspect.signature(df.run).parameters["progress"].annotation
    told = {name: getattr(df, name) for name in dir(df) if "See :func:`run`." in (getattr(df, name).__doc__ or "")}
    assert {"noise", "noisy_motion", "switching_rate"} < set(told)
    other = [name for name, one in told.items() if inspect.signature(one).parameters["progress"].annotation != wanted]
    assert not other
