"""How far states are apart from each other, and motions that find none."""

import numpy as np
import pytest
from compiled import apart, reach

import dforce as df


def test_states_without_end_are_infinitely_far_apart_and_nobody_is_warned():
    a = np.array([[0.1, 0.2], [np.inf, 0.0], [np.nan, 0.0]])
    b = np.array([[0.1, 0.5], [np.inf, 0.0], [0.0, 0.0]])
    np.testing.assert_allclose(apart(a, b), [0.3, np.inf, np.inf])


@pytest.fixture
def over_a_wall():
    """A lever whose Q makes up for the smallest errors at the wall: with 288 samples per period they feed its motion."""
    attraction = df.forces.LennardJones(
        work_of_adhesion="1.7546037989277972 mJ/m^2", equilibrium="0.2691850223493876 nm"
    )
    charge = df.forces.Electrostatic(bias="181.55919386587357 mV", contact_potential="48.75373209811934 mV")
    return df.Case(
        cantilever=df.Cantilever(f0="283.0849427937044 kHz", k="14.738263484911492 N/m", Q=24434.967443070498),
        drive=df.Drive(A0="18.327881650290562 nm"),
        tip=df.Tip(radius="4.9052252122917175 nm"),
        forces=[attraction, charge],
    )


def test_the_drive_keeps_up_no_more_than_free_motion_at_resonance(over_a_wall):
    assert reach(over_a_wall.problem) == pytest.approx(18.327881650290562e-9, rel=1e-9)


@pytest.mark.long
def test_a_motion_fed_by_the_errors_of_too_few_samples_is_found_anew_with_more(over_a_wall):
    found = df.dwell(over_a_wall, zc="16.255451470725316 nm")
    fine = df.dwell(over_a_wall.replace("solver.points_per_period", 4608), zc="16.255451470725316 nm")
    assert int(found.status) == df.Status.OK
    assert float(found.max_deflection) < 18.33e-9
    np.testing.assert_allclose(found.amplitude, fine.amplitude, rtol=1e-6)


def test_a_lever_that_errors_at_a_wall_feed_is_found_to_repeat_with_more_samples():
    """Steps that are longer than the wall is wide kept an amplitude of 15 nm, which did not repeat, in place of 26 nm."""
    case = df.Case(
        cantilever=df.Cantilever(f0="232 kHz", k="18.5 N/m", Q=60.8),
        drive=df.Drive(A0="32.7 nm"),
        tip=df.Tip(radius="5.41 nm"),
        forces=[df.forces.LennardJones(work_of_adhesion="26.7 mJ/m^2", equilibrium="0.168 nm")],
        experiment=df.experiments.Dwell(zc="25.8 nm"),
    )
    exact = df.run(case.replace("solver.points_per_period", 8192))
    assert exact.status == df.Status.OK
    for method in ("periodic", "transient"):
        found = df.run(case.replace("solver.method", method))
        assert found.status == df.Status.OK
        np.testing.assert_allclose(found.amplitude, exact.amplitude, atol=1e-4 * 32.7e-9)
    swept = df.sweep(case, {"cantilever.Q": [60.8, 61.0]})
    assert (swept.status == df.Status.OK).all()


def test_chaos_is_left_with_the_first_samples():
    """From the same state it goes the same way with more."""
    case = df.Case(
        cantilever=df.Cantilever(f0="64.3659 kHz", k="0.498 N/m", Q=9.24),
        drive=df.Drive(A0="88.6 nm", frequency="59.8517 kHz"),
        tip=df.Tip(radius="4.08 nm"),
        sample=df.Sample(youngs_modulus="10.8 GPa"),
        forces=[df.forces.DMT(hamaker="1.39e-19 J")],
    )
    found = df.dwell(case, zc="60.78 nm")
    assert found.status == df.Status.NOT_REPEATING
    assert found.attrs["samples_per_period"] == 256


def test_few_taps_that_more_samples_miss_do_not_ask_for_more_everywhere():
    """A sticky sample is touched once in several periods; near it more samples may miss it, and both go on alike."""
    case = df.Case(
        cantilever=df.Cantilever(f0="300 kHz", k="40 N/m", Q=400),
        drive=df.Drive(A0="30 nm"),
        tip=df.Tip(radius="10 nm"),
        sample=df.Sample(youngs_modulus="2 MPa", poisson_ratio=0.45),
        forces=[df.forces.JKR(surface_energy="50 mJ/m^2")],
        experiment=df.experiments.Approach(zc=["36 nm", "25 nm"]),
    )
    found, fine = df.run(case), df.run(case.replace("solver.points_per_period", 1024))
    assert found.attrs["samples_per_period"] == 256
    assert found.status[1] == df.Status.NOT_REPEATING
    np.testing.assert_allclose(found.amplitude, fine.amplitude, rtol=1e-3)
