"""Orbits whose numbers are known from independent integrators, and what the paper's figures show: docs/theory.

Values are met to half a unit of the last digit given, unless a test says why not.
"""

import numpy as np
import pytest

import dforce as df

NM, PN = 1e-9, 1e-12
INTEGRATORS = ("rk4", "engine", "lsoda")


def dwell(case, zc=None, integrator="engine", **settings):
    return df.dwell(case.replace("solver.integrator", integrator).replace("solver.method", "transient"), zc, **settings)


def value(result, name, place=0):
    return float(np.ravel(result[name])[place])


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_table_1_amplitude_modulation_with_each_integrator_at_its_defaults(integrator):
    result = dwell(df.example("table-1-am"), integrator=integrator)
    assert value(result, "status") == df.Status.OK
    assert value(result, "amplitude") == pytest.approx(4.05537 * NM, abs=5e-6 * NM)
    assert value(result, "phase") == pytest.approx(54.204, abs=0.005)
    assert value(result, "peak_force") == pytest.approx(217.99 * PN, rel=5e-5)
    assert value(result, "max_indentation") == pytest.approx(0.22285 * NM, abs=5e-6 * NM)
    assert value(result, "mean_deflection") == pytest.approx(14.75e-3 * NM, abs=5e-6 * NM)
    assert value(result, "contact_fraction") == pytest.approx(0.1040, abs=5e-5)


def test_table_1_amplitude_modulation_to_all_digits_of_the_reference():
    result = dwell(df.example("table-1-am").replace("solver.settle_tolerance", 1e-9))
    assert value(result, "amplitude") == pytest.approx(4.0553735e-9, abs=5e-17)  # settled to 1e-9 of A0 = 5 nm
    assert value(result, "phase") == pytest.approx(54.20379, abs=1e-5)
    assert value(result, "half_peak_to_peak") == pytest.approx(4.0603964e-9, abs=4e-16)
    assert value(result, "peak_force") == pytest.approx(2.1798595e-10, rel=5e-6)
    assert value(result, "max_indentation") == pytest.approx(2.228490e-10, rel=3e-6)
    assert value(result, "mean_deflection") == pytest.approx(1.47524e-11, abs=6e-17)


def test_figure_2_repulsive_branch():
    case = df.example("figure-2").replace("solver.settle_tolerance", 1e-9)
    result = dwell(case, "0.5 nm", start={"amplitude": "0.52 nm", "phase": "32 deg"})
    assert value(result, "amplitude") == pytest.approx(5.2351330e-10, abs=1e-16)
    assert value(result, "phase") == pytest.approx(31.66555, abs=1e-5)
    assert value(result, "mean_deflection") == pytest.approx(-5.57798e-12, abs=3e-17)
    assert value(result, "peak_force") == pytest.approx(1.048105e-10, abs=1e-16)
    # the force is constant at first contact, so it is known to the last digit of the law
    assert value(result, "min_force") == pytest.approx(-9.794919e-11, abs=5e-17)


def test_figure_2_from_rest_ends_on_the_attractive_branch():
    result = dwell(df.example("figure-2"), "0.5 nm", integrator="rk4", start="rest")
    assert value(result, "amplitude") == pytest.approx(0.160 * NM, abs=5e-4 * NM)
    assert value(result, "phase") == pytest.approx(170.8, abs=0.05)


def test_figure_5_viscous_contact():
    forces = [df.forces.DMT(hamaker="0 J"), df.forces.KelvinVoigt(viscosity="100 Pa s")]
    case = df.example("figure-5").replace(forces=forces).replace("solver.settle_tolerance", 1e-9)
    result = dwell(case, "0.2 nm")
    assert value(result, "amplitude") == pytest.approx(2.3755281e-9, abs=1e-16)
    assert value(result, "phase") == pytest.approx(29.37595, abs=2e-5)
    assert value(result, "mean_deflection") == pytest.approx(1.0428144e-10, abs=1e-17)
    # measured from the force, whose root at contact limits the quadrature over 256 samples
    assert value(result, "dissipated_energy") == pytest.approx(3.398424e-19, rel=2e-6)
    assert value(result, "total_dissipated_energy") == pytest.approx(3.395177e-19, rel=2e-6)
    assert value(result, "virial") == pytest.approx(-1.8630741e-19, rel=1e-7)
    assert value(result, "min_force") == pytest.approx(-37.9 * PN, abs=0.05 * PN)
    assert value(result, "peak_force") == pytest.approx(376.8 * PN, abs=0.05 * PN)


def test_figure_5_without_viscosity_has_a_larger_amplitude_and_no_attraction():
    case = df.example("figure-5")
    result = dwell(case.replace(forces=[df.forces.Hertz()]), "0.2 nm", integrator="rk4")
    assert value(result, "amplitude") == pytest.approx(2.54 * NM, abs=5e-3 * NM)
    assert value(result, "phase") == pytest.approx(14.7, abs=0.05)
    assert value(result, "peak_force") == pytest.approx(392.7 * PN, abs=0.05 * PN)
    assert value(result, "min_force") == 0.0


def test_figure_3_attractive_and_repulsive_states_coexist():
    case = df.example("figure-3-air").replace("solver.method", "transient")
    attractive = df.dwell(case, "8 nm", start={"amplitude": "7.8 nm", "phase": "128 deg"})
    repulsive = df.dwell(case, "8 nm", start={"amplitude": "8.3 nm", "phase": "56 deg"})
    assert value(attractive, "phase") == pytest.approx(128.5, abs=0.1)
    assert value(repulsive, "phase") == pytest.approx(55.9, abs=0.1)
    assert value(attractive, "max_indentation") < value(repulsive, "max_indentation")
    assert value(attractive, "total_virial") > 0.0 > value(repulsive, "total_virial")


def test_figure_3_in_air_approach_and_retract_differ():
    """Steps of 0.25 nm throw the motion off the attractive branch on the way in; 9.7 nm ends the repulsive one."""
    case = df.example("figure-3-air").replace("solver.method", "transient")
    curve = df.approach(case, zc=np.linspace(12 * NM, 3 * NM, 37), direction="both")
    assert (curve.status == df.Status.OK).all()
    approach = curve.sel(direction="approach").squeeze("tone")
    retract = curve.sel(direction="retract").squeeze("tone")
    assert approach.phase.sel(zc=9 * NM, method="nearest") > 90.0 > retract.phase.sel(zc=9 * NM, method="nearest")
    # docs/theory/states.md: on retract the repulsive branch holds up to 9.70 nm, so the next point of this grid is attractive
    assert retract.phase.sel(zc=9.5 * NM, method="nearest") < 90.0 < retract.phase.sel(zc=9.75 * NM, method="nearest")
    slope = np.polyfit(retract.zc[retract.zc < 9 * NM], retract.amplitude[retract.zc < 9 * NM], 1)[0]
    assert slope == pytest.approx(1.0, abs=0.01)


def test_figure_3_slope_in_water():
    """Local slope 0.678 at 5 nm and 0.708 at 4.5 nm."""
    case = df.example("figure-3-water").replace("solver.method", "transient")
    curve = df.approach(case, zc=np.linspace(5.05 * NM, 4.45 * NM, 13)).squeeze("tone")
    slope = np.gradient(curve.amplitude, curve.zc)
    assert slope[1] == pytest.approx(0.678, abs=2e-3)
    assert slope[11] == pytest.approx(0.708, abs=2e-3)
    spectrum = df.dwell(case, "5 nm")
    assert value(spectrum, "harmonic_amplitude", 1) == pytest.approx(0.76 * NM, abs=0.005 * NM)


def test_figure_3_with_the_paper_s_jump_in_the_force_changes_branch_at_9_4_nm():
    case = df.example("figure-3-air").replace("solver.method", "transient")
    forces = [df.forces.VanDerWaals(hamaker="2e-20 J", inside="off"), df.forces.Hertz()]
    curve = df.approach(case.replace(forces=forces), zc=np.linspace(12 * NM, 9.2 * NM, 29)).squeeze("tone")
    before, after = curve.sel(zc=9.4 * NM, method="nearest"), curve.sel(zc=9.3 * NM, method="nearest")
    assert value(before, "amplitude") == pytest.approx(9.17 * NM, abs=0.005 * NM)
    assert value(after, "amplitude") == pytest.approx(9.37 * NM, abs=0.005 * NM)
    assert value(before, "phase") == pytest.approx(113.5, abs=0.05)
    assert value(after, "phase") == pytest.approx(69.6, abs=0.05)


def test_figure_6_peak_forces_repeat_every_five_periods():
    result = dwell(df.example("figure-6"), integrator="rk4")
    peaks = result.force.values.reshape(10, -1).max(axis=1)
    # printed with two decimals, of samples: here at most half a sample beside the peak
    assert sorted(peaks[:5] * 1e9) == pytest.approx(sorted([2.07, 3.81, 4.51, 4.12, 2.70]), abs=0.1)
    # settled to 1e-6 of A0, and dF/dd is about 3 N/m
    assert peaks[5:] == pytest.approx(peaks[:5], rel=1e-4)
    # the attraction is largest at first contact, and saturates there: -HR/6 a0^2
    assert value(result, "min_force") == pytest.approx(-244.9 * PN, abs=0.1 * PN)


def test_figure_7_phase_of_the_first_mode_follows_from_its_amplitude_alone():
    """Attractive branch: sin(phase) = A/A0 for each Hamaker constant; the phase of the second mode tells them apart."""
    seconds = []
    for name, expected in (("figure-7-low", (141.0, 146.0)), ("figure-7-high", (131.5, 132.5))):
        curve = df.approach(df.example(name).replace("solver.method", "transient"), zc=np.linspace(20e-9, 10e-9, 11))
        last = curve.sel(zc=10 * NM, method="nearest")
        assert expected[0] < value(last, "phase", 1) < expected[1]
        a, lag = curve.mode_amplitude.values[:, 0], curve.mode_phase.values[:, 0]
        # drive 2 acts on mode 1 too, and harmonics are neglected: 0.01 degrees
        assert lag == pytest.approx(180.0 - np.degrees(np.arcsin(a / 17e-9)), abs=0.012)
        seconds.append(value(last, "phase", 1))
    assert seconds[0] - seconds[1] > 5.0
