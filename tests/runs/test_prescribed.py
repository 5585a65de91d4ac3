"""Forces over a prescribed motion: any path given by samples, and a slow approach and retract."""

import math

import numpy as np
import pytest

import dforce as df
from dforce.core.errors import ParameterError

F = df.forces
A0, R, E_EFF = 0.165e-9, 20e-9, 1e9 / 0.91


def case(*forces, radius=R):
    return df.Case(
        cantilever=df.Cantilever(f0="48.9 kHz", k="0.9 N/m", Q=100),
        drive=df.Drive(A0="10 nm"),
        tip=df.Tip(radius=radius),
        sample=df.Sample(youngs_modulus="1 GPa", poisson_ratio=0.3),
        forces=forces,
    )


def tap(zc=9e-9, amplitude=9.5e-9, frequency=48.9e3, periods=1, samples=4001):
    time = np.linspace(0.0, periods / frequency, samples)
    return time, zc + amplitude * np.cos(2.0 * math.pi * frequency * time)


def test_the_force_along_a_motion_is_the_law_at_its_distance_and_velocity():
    time, distance = tap(samples=801)
    result = df.force_along(case(F.DMT(hamaker=2e-20), F.KelvinVoigt()), time=time, distance=distance)
    omega = 2.0 * math.pi * 48.9e3
    speed = -9.5e-9 * omega * np.sin(omega * time)
    # the error of a cubic spline's slope falls with the cube of the step, here 1/800 of the period
    np.testing.assert_allclose(result.velocity, speed, atol=1e-6 * 9.5e-9 * omega)
    depth = np.clip(A0 - distance, 0.0, None)
    np.testing.assert_array_equal(result.indentation, depth)
    outside = -2e-20 * R / (6.0 * np.maximum(distance, A0) ** 2)
    contact = 4.0 / 3.0 * E_EFF * np.sqrt(R) * depth**1.5
    np.testing.assert_allclose(result.partial_force.sel(model="dmt"), outside + contact, rtol=1e-12)
    drag = -100.0 * np.sqrt(R * depth) * result.velocity
    np.testing.assert_allclose(result.partial_force.sel(model="kelvin_voigt"), drag, atol=1e-24)
    np.testing.assert_allclose(result.force, result.partial_force.sum("model"))


def test_the_energy_along_a_motion_is_the_closed_form_of_a_viscous_contact():
    time, distance = tap()
    result = df.force_along(case(F.KelvinVoigt(viscosity=100.0), radius=2e-9), time=time, distance=distance)
    # Simpson's rule on a square root at both ends of the contact: 7e-5 by these samples, 3e-6 by four times as many
    assert float(result.energy[-1]) == pytest.approx(6.52042150859e-20, rel=1e-4, abs=0.0)


def test_the_energy_does_not_depend_on_how_many_distances_or_samples_are_asked_for():
    few = df.force_curve(case(F.AdhesionHysteresis()), distance=["20 nm", "-2 nm"])
    # 4 pi R (gamma_r - gamma_a) times the depth, and the same outside
    both = 4.0 * np.pi * R * 0.01 * (2e-9 + A0 + A0**2 * (1.0 / A0 - 1.0 / 20e-9))
    assert float(few.energy) == pytest.approx(both, rel=1e-8, abs=0.0)
    time, distance = tap(samples=61)
    result = df.force_along(case(F.KelvinVoigt(viscosity=100.0), radius=2e-9), time=time, distance=distance)
    # a spline through 60 samples of a period meets the motion within 1e-4 of the depth
    assert float(result.energy[-1]) == pytest.approx(6.52042150859e-20, rel=1e-3, abs=0.0)


@pytest.mark.slow
def test_a_latch_and_a_memory_carry_over_from_tap_to_tap():
    time, distance = tap(zc=4e-9, amplitude=4.5e-9, periods=3)
    neck = df.force_along(case(F.Capillary()), time=time, distance=distance).energy.values
    cycles = np.diff(neck[[0, len(time) // 3, 2 * len(time) // 3, -1]])
    assert cycles == pytest.approx(np.full(3, cycles[0]), rel=1e-3)
    slow = F.SLS(relaxation_time="50 us")
    surface = df.force_along(case(slow), time=time, distance=distance)
    peaks = surface.force.values.reshape(-1)[[len(time) // 6, len(time) // 2]]
    assert peaks[1] < 0.98 * peaks[0]  # the second tap meets a surface that has not recovered


def test_jkr_loses_the_closed_form_over_a_slow_curve():
    gamma = 0.05
    curve = df.force_curve(case(F.JKR(surface_energy=gamma)), distance=np.linspace(3e-9, -2e-9, 2001))
    expected = 22.516318693 * (gamma**5 * R**4 / E_EFF**2) ** (1.0 / 3.0)
    assert float(curve.energy) == pytest.approx(expected, rel=2e-6, abs=0.0)  # by 2001 distances
    pull_off = float(curve.force.sel(direction="retract").min())
    assert pull_off == pytest.approx(-3.0 * math.pi * gamma * R, rel=1e-4)
    assert float(curve.force.sel(direction="approach").sel(distance=1e-9, method="nearest")) == 0.0


def test_a_slow_curve_meets_the_relaxed_modulus_and_a_quick_one_the_instant_modulus():
    model = F.SLS(instant_modulus="1 GPa", relaxed_modulus="100 MPa", relaxation_time="10 us")
    distance = np.linspace(1e-9, -1e-9, 101)
    depth = A0 - distance[-1]
    for speed, modulus in ((1e-8, 0.1e9), (1e2, 1e9)):
        deepest = df.force_curve(case(model), distance=distance, speed=speed).force[:, -1].values
        hertz = 4.0 / 3.0 * modulus / 0.91 * math.sqrt(R) * depth**1.5
        # at 10 nm/s the contact grows for 0.1 s and at 100 m/s for 10 ps, 1e4 and 1e-6 relaxation times;
        # the error of the surface made of elements is the inverse square of their number in contact, 24
        np.testing.assert_allclose(deepest, hertz, rtol=2e-3)


def test_forces_that_depend_on_distance_alone_are_the_same_both_ways():
    curve = df.force_curve(case(F.DMT(hamaker=2e-20)))
    approach, retract = curve.force.values
    np.testing.assert_array_equal(approach, retract)
    assert abs(float(curve.energy)) < 1e-9 * np.abs(approach).max() * 3e-9


def test_distances_come_back_in_the_order_given():
    down = df.force_curve(case(F.JKR(surface_energy=0.05)), distance=np.linspace(2e-9, -1e-9, 7))
    up = df.force_curve(case(F.JKR(surface_energy=0.05)), distance=np.linspace(-1e-9, 2e-9, 7))
    np.testing.assert_allclose(up.distance, down.distance[::-1], atol=1e-24)  # as linspace rounds
    np.testing.assert_allclose(up.force, down.force[:, ::-1], rtol=1e-12)
    texts = df.force_curve(case(), distance=["2 nm", "-1 nm", "0 nm"])
    np.testing.assert_allclose(texts.distance, [2e-9, -1e-9, 0.0])


@pytest.mark.parametrize(
    "forces",
    [(), (F.DMT(hamaker=1e-19),), (F.JKR(surface_energy=0.1),), (F.Capillary(volume="100 nm^3"), F.Hertz())],
    ids=["none", "dmt", "jkr", "capillary"],
)
def test_the_range_chosen_shows_all_that_is_felt(forces):
    chosen = case(*forces)
    curve = df.force_curve(chosen)
    far, near = float(curve.distance[0]), float(curve.distance[-1])
    assert far >= 2e-9
    assert near <= A0 - 0.3e-9
    wide = df.force_curve(chosen, distance=np.linspace(20e-9, near, 801))
    outside = wide.force.where(wide.distance > far, 0.0)
    assert float(np.abs(outside).max()) <= 0.011 * float(np.abs(wide.force.where(wide.force < 0.0, 0.0)).max())


def test_equal_models_have_names_of_their_own():
    both = df.force_curve(case(F.Custom(law="d"), F.Custom(law="2*d")))
    assert list(both.model.values) == ["custom_1", "custom_2"]


def test_a_law_of_the_deflection_takes_an_average_distance():
    spring = case(F.Custom(law="-0.1*z"))
    with pytest.raises(ParameterError, match=r"custom depends on the deflection z, .* pass zc"):
        df.force_curve(spring)
    curve = df.force_curve(spring, distance=[5e-9, 1e-9], zc="4 nm")
    np.testing.assert_allclose(curve.force[0], [-1e-10, 3e-10])


def test_results_are_written_and_read_like_others(tmp_path):
    curve = df.force_curve(case(F.JKR(surface_energy=0.05), F.KelvinVoigt()))
    assert df.read(df.write(curve, tmp_path / "curve.nc")).identical(curve)
    assert curve.force.attrs["units"] == "N"
    assert [force.name for force in df.Case.from_toml(curve.attrs["case"]).forces] == ["jkr", "kelvin_voigt"]
    header = [line for line in df.write(curve, tmp_path / "curve.csv").read_text().splitlines() if line[0] != "#"]
    assert header[0] == "direction,distance (m),force (N),partial_force_jkr (N),partial_force_kelvin_voigt (N)"


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"time": [0.0, 1.0], "distance": [1e-9]}, "at least two numbers"),
        ({"time": [0.0, 1.0, 2.0], "distance": [1e-9, 2e-9]}, "time has 3 values and distance 2"),
        ({"time": [0.0, 0.0], "distance": [1e-9, 2e-9]}, "do not increase"),
        ({"time": [0.0, math.nan], "distance": [1e-9, 2e-9]}, "not a finite number"),
        ({"time": "now", "distance": [1e-9, 2e-9]}, "is not an array"),
        ({"time": [0.0, 1.0], "distance": ["1 nm", "2 K"]}, "distance is '2 K', which is"),
    ],
)
def test_a_motion_that_is_none_is_one_sentence(given, words):
    with pytest.raises(ParameterError, match=words):
        df.force_along(case(), **given)


def test_a_curve_that_is_none_is_one_sentence():
    with pytest.raises(ParameterError, match="two different distances"):
        df.force_curve(case(), distance=[1e-9, 1e-9])
    with pytest.raises(ParameterError, match="is not above 0 m/s"):
        df.force_curve(case(), speed="-1 um/s")


def test_a_law_without_a_value_gives_no_number_there():
    curve = df.force_curve(case(F.Custom(law="sqrt(d - 1e-9)")), distance=[2e-9, 0.5e-9, 1.5e-9])
    assert np.isnan(curve.force.values).tolist() == [[False, True, False]] * 2
    assert np.isnan(curve.energy)
    (found,) = [one for one in df.advice(curve) if one.name == "law_without_value"]
    assert "at d = 0.5 nm, and 2 of 6 forces have no value" in found.text
    assert {one.name: one.text for one in df.summary(curve)}["energy"] == "-"


def test_the_force_along_a_motion_is_summed_up_and_drawn():
    time, distance = tap(samples=401)
    result = df.force_along(case(F.DMT(hamaker=2e-20), F.KelvinVoigt()), time=time, distance=distance)
    found = {one.name: one.value for one in df.summary(result)}
    assert found["peak_force"] == float(result.force.max())
    assert found["energy"] == float(result.energy[-1]) > 0.0
    assert [axes.get_ylabel().split()[0] for axes in df.plot.overview(result)] == ["distance", "force"]
