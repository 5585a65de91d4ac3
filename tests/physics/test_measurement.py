"""What is measured on a motion is as good as the motion, and numbers that the samples spoil are refined or told."""

import math

import numpy as np
import pytest
from compiled import INTEGRATORS, finish, modulus, phase_lag, product

import dforce as df
from dforce.checks.validation.tip_equation import Region, TipEquation, dmt_with_drag, jkr
from dforce.problem import Instrument, Problem

A0 = 0.165e-9
WALL = df.Case(  # a Lennard-Jones wall that is passed within one of 256 steps
    cantilever=df.Cantilever(f0="163.3 kHz", k="10.86 N/m", Q=728), drive=df.Drive(A0="3.683 nm"),
    tip=df.Tip(radius="40.68 nm"), sample=df.Sample(youngs_modulus="1 GPa"),
    forces=[df.forces.LennardJones(work_of_adhesion="0.03271 J/m^2", equilibrium="0.3013 nm")],
)  # fmt: skip


def over_the_wall(zc):
    return df.Case(
        **{name: getattr(WALL, name) for name in ("cantilever", "drive", "tip", "sample", "forces")},
        experiment=df.experiments.Approach(zc=tuple(zc)),
    )


NEAR_THE_WALL = "2.5956 nm"
MEASURED = (
    "mean_force", "total_virial", "total_dissipated_energy", "peak_force", "min_force", "min_distance",
    "contact_fraction",
)  # fmt: skip
AVERAGES = MEASURED[:3]


def viscous():
    problem = Problem.build(
        Instrument(
            df.Cantilever(f0=5e4, k=0.9, Q=100), df.Drive(A0=10e-9), df.Tip(radius=10e-9), df.Sample(youngs_modulus=1e8)
        ),
        forces=[df.forces.DMT(hamaker=1e-20), df.forces.KelvinVoigt(viscosity=100.0)],
    )
    return problem, 6e-9, dmt_with_drag(10e-9, 1e8 / 0.91, 1e-20, 100.0, A0), Region(A0, A0)


def sticky():
    problem = Problem.build(
        Instrument(
            df.Cantilever(f0=7e4, k=2.0, Q=150), df.Drive(A0=20e-9), df.Tip(radius=10e-9), df.Sample(youngs_modulus=1e9)
        ),
        forces=[df.forces.JKR(surface_energy=0.03)],
    )
    return problem, 15e-9, *jkr(0.03, 10e-9, 1e9 / 0.91, A0)


@pytest.mark.parametrize("contact", [viscous, sticky])
def test_the_engine_measures_as_exactly_as_it_integrates(contact):
    """One settled period against DOP853, which solves the averages along with the motion.

    The roots of these forces at the kinks are the hardest part of the averages.
    The reference takes extremes from a parabola through 40 points of a step, good to 1e-6.
    """
    from dforce.solvers.integrator import with_amplitudes
    from dforce.solvers.transient import settle

    problem, zc, law, region = contact()
    settings = df.SolverSettings(method="transient", integrator="engine", settle_tolerance=1e-9)
    integrator = INTEGRATORS["engine"](problem, settings, 1)
    integrator.place(zc)
    motion, settled, *_ = settle(integrator, with_amplitudes(integrator, integrator.problem.free), lambda: None)
    assert settled
    _, rows = integrator.observe(motion, 1)
    found = finish(problem, 1, rows, np.ones(1))
    (mode,), (tone,) = problem.modes, problem.tones
    equation = TipEquation(
        [(mode.f0, mode.k, mode.Q)], [(tone.frequency, [tone.force], 0.0)], zc, law, [region], length=tone.A0
    )
    z, v = (
        np.array([motion.y[i] * scale]) for i, scale in enumerate((integrator.scales.length, integrator.scales.speed))
    )
    expected = equation.measure(z, v, 1.0 / tone.frequency)
    work = np.pi * tone.force * tone.A0
    push = max(abs(expected["peak_force"]), abs(expected["min_force"]))
    sizes = {
        "mean_force": push, "peak_force": push, "min_force": push, "total_virial": work,
        "total_dissipated_energy": work, "min_distance": tone.A0, "contact_fraction": 1.0,
    }  # fmt: skip
    # the equation's last region is that of the force, which a sticky contact leaves later than the surface
    for name in MEASURED if contact is viscous else MEASURED[:-1]:
        assert found[name] == pytest.approx(expected[name], abs=(6e-8 if name in AVERAGES else 1e-6) * sizes[name]), (
            name
        )


@pytest.mark.parametrize("method", ["periodic", "transient"])
def test_a_wall_that_a_step_passes_gets_the_samples_that_it_needs(method):
    """DOP853 gives 0.44305 nm and -0.1106 nN; a step over the wall gave 0.05 nm and 1.8e5 nN."""
    found = df.dwell(WALL.replace("solver.method", method), NEAR_THE_WALL)
    assert found.status == df.Status.OK
    assert found.attrs["samples_per_period"] > 256
    assert float(found.amplitude[0]) == pytest.approx(0.44305e-9, abs=5e-15)
    assert float(found.peak_force) == pytest.approx(-0.11065e-9, abs=5e-15)


@pytest.mark.parametrize(
    ("method", "zc"), [("periodic", "2.61 nm"), ("transient", "2.6112 nm"), ("transient", "2.6292 nm")]
)
def test_a_motion_that_steps_over_a_wall_throw_about_gets_more_samples(method, zc):
    """With 256 samples it wanders, to 7.6 nm: twice the free amplitude."""
    case = WALL.replace("solver.method", method)
    found, fine = df.dwell(case, zc), df.dwell(case.replace("solver.points_per_period", 2048), zc)
    assert found.status == df.Status.OK
    assert float(found.amplitude[0]) == pytest.approx(float(fine.amplitude[0]), rel=1e-4)


def test_a_curve_over_a_wall_and_a_sweep_of_it_refine_each_point_that_needs_it():
    zc = np.linspace(3.2e-9, 2.6e-9, 4)
    curve = df.approach(WALL, zc=zc)
    fine = df.approach(WALL.replace("solver.points_per_period", 2048), zc=zc)
    assert (curve.status == df.Status.OK).all()
    np.testing.assert_allclose(curve.amplitude, fine.amplitude, rtol=1e-4)
    np.testing.assert_allclose(curve.peak_force, fine.peak_force, rtol=1e-3)
    swept = df.sweep(over_the_wall(zc), over={"cantilever.Q": [700.0, 728.0]})
    np.testing.assert_allclose(swept.amplitude.isel(Q=1), fine.amplitude, rtol=1e-4)


def test_numbers_that_no_samples_mend_are_none_and_say_why(as_sampled):
    found = df.dwell(WALL, NEAR_THE_WALL)
    assert found.status == df.Status.UNRESOLVED
    assert "too steep for the samples" in df.Status.UNRESOLVED.sentence
    assert np.isnan(found.amplitude).all()
    assert np.isnan(found.peak_force)


def test_fewer_elements_of_a_viscoelastic_contact_are_enough():
    """A tap into a tenth of the radius: a parabola between elements errs by the cube of their distance.

    The default of 48, two thirds of them in contact, is good to 1e-4, and half as many to 1e-3.
    """
    from dforce.checks.battery import follow

    def tap(t):
        phase = 2.0 * np.pi * 70e3 * t
        return A0 - (0.6e-9 - 15e-9 * (1.0 - np.cos(phase))), -15e-9 * 2.0 * np.pi * 70e3 * np.sin(phase)

    def pressed(elements):
        solid = df.forces.SLS(
            instant_modulus=1e9, relaxed_modulus=2e8, relaxation_time=2e-6, elements=elements, max_indentation=10e-9
        )
        bound = solid.bind({"tip.radius": 10e-9, "sample.poisson_ratio": 0.0, "contact.a0": A0})
        return follow(bound, tap, np.linspace(-1e-6, 1e-6, 4001), compiled=True)

    best = pressed(384)
    for elements, error in ((24, 1e-3), (48, 1.5e-4)):
        found = pressed(elements)
        assert found.energy[-1] == pytest.approx(best.energy[-1], rel=error)
        assert found.force.max() == pytest.approx(best.force.max(), rel=error)


def test_a_phase_is_the_same_wherever_its_result_comes_to_lie(monkeypatch):
    """NumPy 2.0 takes strided numbers for overlapped by what lies right behind them, and rounds otherwise then."""
    random, arctan2 = np.random.default_rng(1), np.arctan2
    for count in range(1, 40):
        room = np.zeros(5 * count)
        pairs, behind = room[: 4 * count].view(complex).reshape(count, 2), room[4 * count :]
        pairs[:, 1] = random.normal(size=count) + 1j * random.normal(size=count)
        apart = [phase_lag(pairs[i : i + 1, 1].copy()).item() for i in range(count)]
        with monkeypatch.context() as patch:
            patch.setattr(np, "arctan2", lambda y, x, behind=behind: arctan2(y, x, out=behind))
            np.testing.assert_array_equal(phase_lag(pairs[:, 1]), apart)


def test_moduli_and_products_are_rounded_as_real_numbers_are():
    random = np.random.default_rng(2)
    pairs = random.normal(size=(100, 2)) + 1j * random.normal(size=(100, 2))
    a, b = pairs.T
    np.testing.assert_array_equal(modulus(a), [math.sqrt(c.real * c.real + c.imag * c.imag) for c in a.tolist()])
    by_hand = [complex(c.real * d.real - c.imag * d.imag, c.real * d.imag + c.imag * d.real) for c, d in pairs.tolist()]
    np.testing.assert_array_equal(product(a, b), by_hand)
