"""A fit refuses with one sentence what it cannot tell, and what it would get wrong."""

import fitted_curves as fc
import numpy as np
import pytest
import xarray as xr
from fitted_curves import ETA, E, H

import dforce as df


def bimodal(f2: str = "434 kHz") -> df.Case:
    """Return the stiff case with a second tone."""
    case = fc.case_of("stiff")
    modes = [{"f0": "70 kHz", "k": "2.7 N/m", "Q": 180}, {"f0": f2, "k": "106 N/m", "Q": 450}]
    return case.replace(cantilever={"modes": modes}, drive={"tones": [{"A0": "30 nm"}, {"A0": "1 nm"}]})


def with_tone_2() -> xr.Dataset:
    """Return data with a second tone."""
    data = fc.data_of("stiff")
    out = data.assign(amplitude_2=0.0 * data["amplitude"] + 1e-9, phase_2=0.0 * data["phase"] + 90.0)
    return out.assign_attrs(amplitude_2_error=5e-12, phase_2_error=0.3)


REFUSED = {
    "radius and modulus": ({"free": [E, "tip.radius"]}, "only their product"),
    "radius and Hamaker constant": ({"free": [H, "tip.radius"]}, "only their product"),
    "k and modulus": ({"free": [E, "cantilever.k"]}, "only forces over k"),
    "k and Q": ({"free": ["cantilever.k", "cantilever.Q"]}, "without a prior for one of them"),
    "nothing free": ({"free": []}, "must name the parameters"),
    "unknown parameter": ({"free": ["sample.youngs"]}, "youngs_modulus"),
    "twice": ({"free": [E, E]}, "appears twice"),
    "the same by two names": ({"free": [H, "forces.1.hamaker"]}, "the same parameter"),
    "has no effect on the forces": ({"free": ["sample.thickness"]}, "is not in the case"),
    "prior without error": ({"free": [E], "priors": {"cantilever.Q": "180"}}, "has no error"),
    "bound outside the domain": (
        {"free": [E], "bounds": {E: ["-1 GPa", "1 GPa"]}},
        "-1 GPa to 1 GPa is not a range within 0 Pa to",
    ),
    "start outside its bounds": (
        {"free": [E], "bounds": {E: ["3 GPa", "9 GPa"]}},
        "starts at 2 GPa, outside of its bounds 3 GPa to 9 GPa",
    ),
    "start below zero": ({"free": [E], "start": {E: -1.0}}, "start.* = -1 Pa is not above 0"),
    "prior below zero": (
        {"free": [E], "priors": {"cantilever.Q": (-180, 1)}},
        "priors.cantilever.Q = -180 is not above 0",
    ),
    "given and fitted": ({"free": [E], "given": {E: "5(1) GPa"}}, "given has .* but the fit varies it.*under priors"),
    "given without an error": (
        {"free": [E], "given": {"tip.radius": "8 nm"}},
        "given.tip.radius = '8 nm' has no error",
    ),
    "bounds of what is fixed": ({"free": [H], "bounds": {E: ["1 GPa", "2 GPa"]}}, "but the fit does not vary it"),
    "sigma of zero": ({"free": [E], "errors": {"amplitude": 0.0}}, "must be above 0"),
    "error of the height without its unit": ({"free": [E], "errors": {"height": 50.0}}, "is the unit missing"),
    "error of the amplitude without its unit": (
        {"free": [E], "errors": {"amplitude": "60"}},
        "60 m, more than 1000 times",
    ),
    "unknown branch": ({"free": [E], "branch": "upper"}, "branch"),
    "profile of what is fixed": ({"free": [H], "profile": [E]}, "but the fit does not vary it"),
    "unknown setting": ({"free": [E], "prior": {}}, "priors"),
    "nuisance of tone 2": ({"free": [E], "nuisance": ["A0_2"]}, "tone 2"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_a_fit_refuses(what: str) -> None:
    settings, words = REFUSED[what]
    with pytest.raises(df.ParameterError, match=words) as error:
        df.fit(fc.case_of("stiff"), fc.data_of("stiff"), **settings)
    assert "\n" not in str(error.value)


def test_a_fit_refuses_a_parameter_that_no_force_reads() -> None:
    case = df.Case(
        **fc.INSTRUMENTS["air"], drive={"A0": "10 nm"}, sample={"youngs_modulus": "1 GPa"},
        forces=[df.forces.VanDerWaals(hamaker="2e-20 J")],
    )  # fmt: skip
    with pytest.raises(df.ParameterError, match="has no effect on the forces of this case \\(van_der_waals\\)"):
        df.fit(case, fc.data_of("air"), free=[E])


def test_a_fit_refuses_more_unknowns_than_the_data_can_tell() -> None:
    data = fc.data_of("stiff").isel(point=slice(0, 10))
    with pytest.raises(df.ParameterError, match="6 unknowns are too many for 20 measured numbers"):
        df.fit(fc.case_of("stiff"), data, free=[E, H, ETA], margin=0)


def test_a_fit_refuses_a_repulsive_branch_where_all_phases_are_above_90_degrees() -> None:
    with pytest.raises(df.ParameterError, match="all phases are above 90 degrees"):
        df.fit(fc.case_of("stiff"), fc.data_of("stiff").isel(point=slice(0, 40)), free=[E], branch="repulsive")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (lambda data: data.drop_vars("phase"), "have no 'phase'"),
        (lambda data: data.assign_attrs(amplitude_error=0.0), "must be above 0"),
        (lambda data: xr.Dataset(data.variables, attrs={}), "the noise of 'amplitude' is unknown: calibrate"),
        (lambda data: data.assign(phase=data["phase"].where(np.arange(126) != 7)), "not a number at point 8"),
        (lambda data: data.isel(point=slice(0, 5)), "at least 8"),
    ],
)
def test_a_fit_refuses_data_that_lack_something(data: object, words: str) -> None:
    with pytest.raises(df.ParameterError, match=words):
        df.fit(fc.case_of("stiff"), data(fc.data_of("stiff")), free=[E])  # type: ignore[operator]


@pytest.mark.parametrize("name", ["amplitude_2", "phase_2"])
def test_a_fit_refuses_half_a_second_tone(name: str) -> None:
    data = fc.data_of("liquid")
    with pytest.raises(df.ParameterError, match=f"the data have {name} alone of tone 2; remove it"):
        df.fit(fc.case_of("liquid"), data.assign({name: data["phase"]}), free=[E])


def test_a_fit_refuses_a_tone_that_the_case_lacks() -> None:
    with pytest.raises(df.ParameterError, match="the curve has tone 2, but the case has only 1 tone"):
        df.fit(fc.case_of("stiff"), with_tone_2(), free=[E])


def test_a_fit_refuses_tones_without_a_common_period() -> None:
    with pytest.raises(df.ParameterError, match="no common period"):
        df.fit(bimodal("438.9531 kHz"), with_tone_2(), free=[E])


def test_identify_refuses_to_tell_nothing() -> None:
    with pytest.raises(df.ParameterError, match="free must name the parameters to fit"):
        df.identify(fc.case_of("air"))


def test_identify_refuses_one_distance() -> None:
    with pytest.raises(df.ParameterError, match="a curve needs several"):
        df.identify(fc.case_of("air"), zc=["5 nm", "5 nm"], free=[E])


def test_identify_refuses_errors_of_what_a_curve_does_not_have() -> None:
    with pytest.raises(df.ParameterError, match="known: amplitude"):
        df.identify(fc.case_of("air"), free=[E], errors={"phases": 0.3}, helps=False)
    with pytest.raises(df.ParameterError, match="above 0"):
        df.identify(fc.case_of("air"), free=[E], errors={"phase": 0.0}, helps=False)
