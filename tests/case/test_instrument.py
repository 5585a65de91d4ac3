"""The instrument as a user describes it, and the problem that comes of it."""

import cmath
import math

import numpy as np
import pytest
from every import every
from hypothesis import given
from hypothesis import strategies as st

import dforce as df
from dforce import forces, library
from dforce.core.errors import ForceError, ParameterError
from dforce.core.parameters import shared
from dforce.instrument import Beam, Cantilever, Contact, Drive, Medium, Mode, Sample, Tip, Tone, effective_modulus
from dforce.instrument.shared import instrument_values
from dforce.problem import Instrument, Problem

SILICON = {
    "youngs_modulus": "169 GPa",
    "density": "2330 kg/m^3",
    "length": "225 um",
    "width": "28 um",
    "thickness": "3 um",
}
LEVER = Cantilever(f0="48.9 kHz", k="0.9 N/m", Q=255)
TWO = Cantilever(modes=[{"f0": "50 kHz", "k": "0.9 N/m", "Q": 10}, {"f0": "310 kHz", "k": "35.2 N/m", "Q": 62.7}])
ONE_TONE = Drive(A0="10 nm")
TIP, SAMPLE = Tip(radius="2 nm"), Sample(youngs_modulus="1 GPa")


def refusal(call, *args, **kwargs):
    with pytest.raises(ParameterError) as raised:
        call(*args, **kwargs)
    message = str(raised.value)
    assert "\n" not in message
    assert len(message) < 250
    return message


# --- the parts


@pytest.mark.parametrize("section", [Medium, Mode, Beam, Cantilever, Tone, Drive, Tip, Sample, Contact])
def test_every_quantity_has_a_unit_a_symbol_a_meaning_and_bounds(section):
    for name, quantity in section.quantities().items():
        assert quantity.unit, name
        assert quantity.symbol, name
        assert quantity.doc, name
        low, high = quantity.bounds()
        assert math.isfinite(low), name
        assert math.isfinite(high), name


@every(
    [
        (lambda: Tip(radius="-2 nm"), "tip.radius = -2 nm is not above 0 nm"),
        (lambda: Tip(half_angle="90 deg"), "tip.half_angle = 90 deg is not below 90 deg"),
        (lambda: Sample(youngs_modulus="-1 GPa"), "sample.youngs_modulus = -1 GPa is not above 0 GPa"),
        (lambda: Sample(poisson_ratio=0.51), "sample.poisson_ratio = 0.51 is above 0.5"),
        (lambda: Contact(a0=0), "contact.a0 = 0 m is not above 0 nm"),
        (lambda: Mode(f0=1e5, k=1, Q=0.5), "mode.Q = 0.5 is not above 0.5"),
        (lambda: Cantilever(f0="48.9 nm", k=1, Q=1), "cantilever.f0 is '48.9 nm', which is a length"),
        (lambda: Cantilever(f0="3 rad/s", k=1, Q=1), "divide an angular frequency by 2 pi"),
        (lambda: Cantilever(), "cantilever is empty; write f0, k and Q, or a list of modes, or a beam"),
        (lambda: Cantilever(f0=1, k=1), "cantilever.Q (quality factor) is missing"),
        (lambda: Cantilever(f0=1, k=1, Q=1, beam=SILICON), "cantilever has both f0, k, Q and beam"),
        (lambda: Cantilever(modes=[{"f0": 1, "k": 1, "Q": 1, "m": 1}]), "cantilever.modes.1 has no parameter 'm'"),
        (lambda: Cantilever(modes=[{"f0": 1, "k": 1, "Q": 1}] * 11), "cantilever.modes"),
        (lambda: Drive(), "drive.A0 (free amplitude) is missing"),
        (lambda: Drive(A0=1e-9, tones=[{"A0": 1e-9}]), "drive has both A0 and tones"),
        (lambda: Drive(A0="0 nm"), "drive.A0 = 0 m is not above 0 nm"),
        (lambda: Drive(A0=1e-9, acts_on="all"), "drive.acts_on = 'all' is not one of 'all_modes' or 'own_mode'"),
        (lambda: Drive(A0=1e-9, mode=True), "drive.mode = true is not allowed here"),
        (lambda: Medium(name="watr"), "write its density and viscosity, or a name; did you mean 'water'?"),
        (lambda: Medium(temperature="0 K"), "medium.temperature = 0 K is not above 0 K"),
        (lambda: Beam(**SILICON, modes=2, Q=[1]), "cantilever.beam.Q has 1 values for 2 modes"),
    ]
)
def test_a_wrong_part_is_refused_in_a_sentence(make, message):
    assert message in refusal(make)


def test_a_medium_by_name_has_the_values_of_the_library():
    water = Medium(name="water")
    assert (water.density, water.viscosity, water.permittivity) == (997.05, 8.9e-4, 78.4)
    assert water.temperature == 298.15
    assert Medium.model_validate("water") == water


def test_a_value_given_beside_the_name_wins():
    assert Medium(name="water", permittivity=80).permittivity == 80
    assert Medium(name="water", permittivity=80).density == 997.05


def test_every_medium_of_the_library_is_complete_and_has_a_source():
    for name, values in library.media().items():
        medium = Medium(name=name)
        assert None not in (medium.density, medium.viscosity, medium.permittivity)
        assert values["source"]


def test_effective_modulus_has_the_reference_values():
    # reference values with twelve digits
    silicon = Tip(youngs_modulus="170 GPa", poisson_ratio=0.28)
    assert effective_modulus(Tip(), Sample(youngs_modulus=1e9)) == pytest.approx(1098901098.90, rel=1e-11)
    assert effective_modulus(silicon, Sample(youngs_modulus=1e9)) == pytest.approx(1092393343.85, rel=1e-11)
    soft = Sample(youngs_modulus=50e6, poisson_ratio=0.5)
    assert effective_modulus(silicon, soft) == pytest.approx(66642581.2538, rel=1e-11)
    assert effective_modulus(silicon, Sample()) is None


# --- modes and tones


def test_a_beam_in_a_fluid_takes_frequency_and_q_from_sader():
    fluid = Medium(density=997, viscosity=8.59e-4)
    (mode,) = Cantilever(beam=SILICON).resolve(fluid)
    assert (mode.f0, mode.Q) == (pytest.approx(34648.9561, rel=1e-9), pytest.approx(4.206747536, rel=1e-9))
    assert mode.k == pytest.approx(2.88882486217, rel=1e-10)


def test_a_given_q_of_a_beam_wins_and_a_list_has_one_for_each_mode():
    (mode,) = Cantilever(beam=SILICON | {"Q": 300}).resolve(Medium(name="air"))
    assert mode.Q == 300
    first, second = Cantilever(beam=SILICON | {"modes": 2, "Q": [300, 500]}).resolve(Medium(name="vacuum"))
    assert (first.Q, second.Q) == (300, 500)
    assert first.f0 == pytest.approx(81527.0769001, rel=1e-10)


@pytest.mark.parametrize(
    ("medium", "why"), [(Medium(name="vacuum"), "vacuum does not damp the beam"), (Medium(), "no fluid is set")]
)
def test_a_q_that_nobody_knows_is_asked_for_in_a_sentence(medium, why):
    message = refusal(Cantilever(beam=SILICON).resolve, medium)
    assert message == f'cantilever.beam.Q is missing, and {why}; write Q, or medium = "air"'


def test_a_beam_that_the_fluid_stops_from_oscillating_is_refused():
    message = refusal(Cantilever(beam=SILICON).resolve, Medium(density=1400, viscosity="1 Pa s"))
    assert "mode 1 of cantilever.beam has Q = 0.3" in message


def test_a_tone_drives_the_mode_of_its_place_at_its_resonance():
    problem = Problem.build(Instrument(TWO, Drive(tones=[{"A0": "10 nm"}, {"A0": "1 nm"}])))
    assert [tone.mode for tone in problem.tones] == [0, 1]
    assert [tone.frequency for tone in problem.tones] == [50e3, 310e3]
    # at resonance F = k A0 / Q
    assert problem.tones[0].force == pytest.approx(0.9 * 10e-9 / 10, rel=1e-15)
    assert problem.tones[1].force == pytest.approx(35.2 * 1e-9 / 62.7, rel=1e-15)


def test_a_tone_for_a_mode_that_is_not_there_is_refused():
    message = refusal(Problem.build, Instrument(LEVER, Drive(tones=[{"A0": 1e-9}, {"A0": 1e-9}])))
    assert message.startswith(
        "drive.tones.2.mode = 2, but the cantilever has only 1 mode; add modes by cantilever.higher_modes"
    )
    assert "drive.mode = 3, but the cantilever has only 2 modes" in refusal(
        Problem.build, Instrument(TWO, Drive(A0=1e-9, mode=3))
    )


def test_the_reference_free_response_has_the_reference_force():
    # f0 = f = 50 kHz, k = 1 N/m, Q = 100, A0 = 10 nm
    problem = Problem.build(Instrument(Cantilever(f0="50 kHz", k=1, Q=100), ONE_TONE))
    assert problem.drive[0, 0] == pytest.approx(1e-10, rel=1e-15)


@given(
    f0=st.floats(1e3, 1e6),
    k=st.floats(1e-3, 1e3),
    Q=st.floats(0.6, 1e5),
    A0=st.floats(1e-11, 1e-6),
    ratio=st.floats(0.05, 3.0),
    phase=st.floats(-6.0, 6.0),
)
def test_the_free_amplitude_is_what_was_asked_for_at_any_frequency(f0, k, Q, A0, ratio, phase):
    problem = Problem.build(Instrument(Cantilever(f0=f0, k=k, Q=Q), Drive(A0=A0, frequency=ratio * f0, phase=phase)))
    # near resonance 1 - r^2 loses the digits of r, and Q says how much that matters
    assert abs(problem.free[0, 0]) == pytest.approx(A0, rel=1e-13 * Q)
    lag = (phase - cmath.phase(problem.free[0, 0])) % (2 * math.pi)
    assert math.sin(lag) >= -1e-9  # a mode never runs ahead of its drive


def test_the_lag_at_resonance_is_a_quarter_turn():
    free = Problem.build(Instrument(LEVER, ONE_TONE)).free[0, 0]
    assert -cmath.phase(free) == pytest.approx(math.pi / 2, abs=1e-15)


def test_a_drive_acts_on_all_modes_or_on_its_own():
    tones = [{"A0": "10 nm"}, {"A0": "1 nm"}]
    both = Problem.build(Instrument(TWO, Drive(tones=tones)))
    own = Problem.build(Instrument(TWO, Drive(tones=tones, acts_on="own_mode")))
    assert np.array_equal(both.drive[:, 0], both.drive[:, 1])
    assert own.drive[0, 1] == own.drive[1, 0] == 0.0
    assert own.free[0, 1] == 0.0
    # far below its resonance mode 2 moves by F1 / k2, with 1 - r^2 = 0.974
    assert abs(both.free[0, 1]) == pytest.approx(0.9e-9 / 35.2 / (1 - (50 / 310) ** 2), rel=1e-4)


def test_arrays_of_a_problem_cannot_be_written_to():
    problem = Problem.build(Instrument(LEVER, ONE_TONE))
    for array in (problem.drive, problem.free):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 0.0


# --- forces in the problem


def test_forces_get_their_shared_values_from_the_instrument():
    problem = Problem.build(Instrument(LEVER, ONE_TONE, TIP, SAMPLE, Contact(a0="0.2 nm")), forces=[forces.Hertz()])
    (hertz,) = problem.forces
    assert (hertz.radius, hertz.a0, problem.a0) == (2e-9, 0.2e-9, 0.2e-9)
    assert hertz.E_eff == pytest.approx(1e9 / 0.91, rel=1e-15)


def test_a_rigid_tip_has_an_infinite_modulus_for_forces_that_ask():
    values = instrument_values(LEVER.resolve(Medium()), TIP, SAMPLE, Contact(), Medium())
    assert values["tip.youngs_modulus"] == math.inf
    assert values["sample.thickness"] is None
    assert values["cantilever.Q"] == 255


@pytest.mark.parametrize(
    ("tip", "sample", "message"),
    [
        (Tip(), SAMPLE, "hertz needs tip.radius, which is missing; write radius under [tip]"),
        (TIP, Sample(), "hertz needs sample.youngs_modulus, which is missing; write youngs_modulus under [sample]"),
    ],
    ids=["radius", "modulus"],
)
def test_what_a_force_lacks_is_said_with_the_section_to_write_it_in(tip, sample, message):
    assert refusal(Problem.build, Instrument(LEVER, ONE_TONE, tip, sample), forces=[forces.Hertz()]) == message


@pytest.mark.parametrize(
    ("chosen", "removed"),
    [
        ([forces.DMT(hamaker=1e-20), forces.VanDerWaals(hamaker=1e-20)], "remove van_der_waals"),
        ([forces.VanDerWaals(hamaker=1e-20), forces.DMT(hamaker=1e-20)], "remove van_der_waals"),
        ([forces.DMT(hamaker=1e-20), forces.Hertz()], "remove hertz"),
        ([forces.Hertz(), forces.KelvinVoigt(), forces.Hertz()], "hertz appears twice; remove one of them"),
    ],
    ids=["whole first", "part first", "contact", "twice"],
)
def test_an_interaction_counted_twice_is_refused_with_the_model_to_remove(chosen, removed):
    message = refusal(Problem.build, Instrument(LEVER, ONE_TONE, TIP, SAMPLE), forces=chosen)
    assert message.endswith(removed.split("; ")[-1])


class Nameless(forces.Force):
    """A law without a name, so that the registry stays as it is; it asks for what no instrument has."""

    color: float = shared("tip.colour")


def test_a_force_that_shares_what_no_instrument_has_is_a_mistake_of_its_author():
    with pytest.raises(ForceError, match=r"takes 'tip.colour' from the instrument, but it has no such value"):
        Problem.build(Instrument(LEVER, ONE_TONE), forces=[Nameless()])


LARGE, SMALL = "is too large to compute with", "is too small to compute with"
EXTREME = [
    ("figure-3-air", "cantilever.k", 1e-200, SMALL),
    ("cell", "cantilever.beam.length", "1e-300 m", SMALL),
    ("cell", "cantilever.beam.density", 5e-324, SMALL),
    ("figure-5", "forces.kelvin_voigt.viscosity", 1e300, LARGE),
    ("fm-afm", "drive.phase_set_point", 1e-120, SMALL),
    ("fm-afm", "drive.phase_set_point", 1e-30, "write one near 90 deg"),
    ("figure-3-air", "drive.frequency", 1e-6, "frequencies of modes and drive range from 1e-06 Hz to 48.9 kHz"),
    ("am-fm", "drive.tones.1.frequency", "10 GHz", "may differ by a factor of 10000 at most"),
]


@every(EXTREME, str)
def test_values_too_extreme_to_compute_with_are_refused(name, path, value, words):
    assert words in refusal(df.example(name).replace, path, value)
