"""Every force in a tapping run: energy is accounted for, and memory and branches go through every solver alike."""

import math

import numpy as np
import pytest
from compiled import F_V, FIRST, INTEGRATORS, F, Z, sample_count
from tiers import some_long

import dforce as df
from dforce.experiments.base import initial_motion
from dforce.forces import REGISTRY
from dforce.problem import Instrument, Problem

TAU = 2 * math.pi
# 38 decay times of a lever with Q = 5: the free motion has died out to 1e-16, and the memory below with it
PERIODS = 60
# a tap of rigid bodies turns the tip within 1 % of the period
SAMPLES, HARMONICS = 4096, 400
# relaxation times that end within the run, and a modulus that a stiff lever feels
CHANGES = {"power_law": {"modulus_at_reference": "300 MPa", "reference_time": "1 us", "longest_time": "10 us"}}


def lever(*forces):
    """Return a lever so stiff that no neck or adhesion holds it: its spring pulls back with k A0 = 100 nN."""
    return Problem.build(
        Instrument(
            df.Cantilever(f0=50e3, k=5.0, Q=5.0),
            df.Drive(A0=20e-9),
            df.Tip(radius=10e-9, youngs_modulus=170e9, poisson_ratio=0.28, half_angle="20 deg"),
            df.Sample(youngs_modulus=1e9, poisson_ratio=0.3, thickness=500e-9, radius=50e-9),
            medium=df.Medium(temperature=298.15, permittivity=78.5),
        ),
        forces=forces,
    )


def reached(problem, integrator, zc, start, periods, harmonics=10, **settings):
    """Return the integrator, and the motion so many periods after its start."""
    chosen = df.SolverSettings(method="transient", integrator=integrator, **settings)
    ready = INTEGRATORS[integrator](problem, chosen, harmonics)
    ready.place(zc)
    return ready, ready.lock_in(initial_motion(ready, start), periods)[0]


@pytest.mark.parametrize("name", sorted(REGISTRY))
def test_what_the_drive_gives_is_what_cantilever_and_sample_take(name):
    model = REGISTRY[name]
    problem = lever(model(**{**model.example, **CHANGES.get(name, {})}))
    ready, motion = reached(problem, "engine", 16e-9, "free", PERIODS - 1, HARMONICS, points_per_period=SAMPLES)
    end, (row,) = ready.observe(motion, 1)
    assert end.y == pytest.approx(motion.y, abs=1e-8)  # periodic: nothing is left over at the end of a period
    mode, tone, length = problem.modes[0], problem.tones[0], ready.scales.length
    total = length * complex(*row[FIRST + 2 : FIRST + 4])
    given = -math.pi * tone.force * total.imag
    pairs = row[FIRST + 4 : FIRST + 4 + 2 * HARMONICS]
    parts = length * np.hypot(pairs[::2], pairs[1::2])
    damping = mode.k / (TAU * mode.f0 * mode.Q)  # m w0 / Q
    mean_square = (ready.record(motion)[1][:-1, 1] ** 2).mean() * ready.scales.speed**2
    taken = -row[F_V] / tone.frequency
    # docs/theory/identities.md: 1e-5 of pi F0 A, with the damping from the velocity and from the harmonics
    scale = math.pi * tone.force * abs(total)
    assert taken == pytest.approx(given - damping * mean_square / tone.frequency, abs=1e-5 * scale)
    squares = (np.arange(1, HARMONICS + 1) ** 2 * parts**2).sum()
    assert taken == pytest.approx(given - math.pi * mode.k / mode.Q * squares, abs=1e-5 * scale)
    # 5.1: the mean force bends the lever, to the 1e-4 of 5.10
    assert row[F] == pytest.approx(mode.k * row[Z] * length, rel=1e-4, abs=1e-6 * tone.force)
    if model.dissipative:
        assert taken > 1e-5 * scale  # so that the balance says something of the loss
    else:
        assert abs(taken) < 1e-5 * scale


def soft(forces, **solver):
    """Return a case with a lever that settles within a hundred periods."""
    return df.Case(
        cantilever=df.Cantilever(f0="50 kHz", k="5 N/m", Q=20), drive=df.Drive(A0="20 nm"),
        tip=df.Tip(radius="10 nm"), sample=df.Sample(youngs_modulus="1 GPa", poisson_ratio=0.3),
        forces=forces, solver=df.SolverSettings(**solver),
    )  # fmt: skip


# a memory that outlasts the time between two taps by half, and a neck that forms and breaks in each
REMEMBERING = [df.forces.SLS(elements=6, relaxation_time="30 us"), df.forces.Capillary()]
ADHESIVE = [df.forces.JKR(surface_energy="50 mJ/m^2")]
WAYS = {
    "lsoda": {"method": "transient", "integrator": "lsoda"},
    # RK4 is of order 2 where a contact's force begins or ends like a root, so it gets four times the samples
    "rk4": {"method": "transient", "integrator": "rk4", "points_per_period": 1024},
    "periodic": {"method": "periodic", "points_per_period": 1024},
}


def check_same(found, reference, a0=20e-9):
    """Agree to what integrators and measurement leave: 1e-6 of A0, 1e-5 of pi F0 A (docs/theory/identities.md)."""
    energy = math.pi * 5.0 * a0 / 20 * reference.amplitude.values.min()
    np.testing.assert_allclose(found.amplitude, reference.amplitude, atol=1e-6 * a0)
    np.testing.assert_allclose(found.phase, reference.phase, atol=2e-3)
    for name in ("total_dissipated_energy", "total_virial"):
        np.testing.assert_allclose(found[name], reference[name], atol=1e-5 * energy)
    for name in ("peak_force", "min_force", "contact_time"):
        np.testing.assert_allclose(found[name], reference[name], rtol=1e-5)


@pytest.mark.parametrize("way", some_long(WAYS, ["lsoda"]))
def test_memory_and_branches_are_the_same_in_every_solver(way):
    reference = df.dwell(soft(REMEMBERING, method="transient", integrator="engine", settle_tolerance=1e-8), "16 nm")
    found = df.dwell(soft(REMEMBERING, **WAYS[way], settle_tolerance=1e-8), "16 nm")
    check_same(found, reference)


def test_memory_and_branches_are_carried_from_distance_to_distance():
    """Not so where the sample is forgotten: it takes tens of periods more to sag again."""
    zc, same = np.linspace(17e-9, 13e-9, 5), {"points_per_period": 256, "settle_tolerance": 1e-8}
    curves = {
        method: df.approach(soft(REMEMBERING, method=method, **same), zc=zc, direction="both")
        for method in ("transient", "periodic")
    }
    assert (curves["periodic"].status == df.Status.OK).all()
    check_same(curves["periodic"], curves["transient"])
    back = curves["transient"].sel(direction="retract")
    check_same(back, curves["transient"].sel(direction="approach"))


def test_an_adhesive_contact_is_a_periodic_orbit_like_any_other():
    case = soft(ADHESIVE, settle_tolerance=1e-8)
    orbit = df.dwell(case, "16 nm")
    check_same(orbit, df.dwell(case.replace("solver.method", "transient"), "16 nm"))
    assert float(orbit.multiplier_modulus.max()) < 1.0
    assert float(orbit.drift) < 1e-8


def test_samples_resolve_the_fastest_relaxation():
    slow, fast = (
        sample_count(soft([model]).problem, df.SolverSettings())
        for model in (df.forces.SLS(relaxation_time="10 us"), df.forces.SLS(relaxation_time="10 ns"))
    )
    assert slow == 256
    assert fast == 4000  # half of 10 ns a step, in 20 us
    with pytest.raises(df.ParameterError, match="sls relaxes in 1e-15 s"):
        sample_count(soft([df.forces.SLS(relaxation_time="1e-15 s")]).problem, df.SolverSettings())


def test_a_drive_that_would_need_terabytes_of_samples_is_refused():
    with pytest.raises(df.ParameterError, match=r"needs 1\.6e\+12 samples per period of the drive"):
        df.frequency_sweep(df.example("figure-3-air"), zc="9 nm", frequency=[1e-6, 48.9e3])


def test_a_relaxation_faster_than_the_sampling_asked_for_leaves_the_relaxed_sample():
    """RK4 with 256 steps would be unstable: the step is 4 relaxation times."""
    fast = df.forces.SLSSimple(instant_modulus="1 GPa", relaxed_modulus="0.5 GPa", relaxation_time="20 ns")
    elastic = df.forces.SLSSimple(instant_modulus="0.5 GPa", relaxed_modulus="0.5 GPa", relaxation_time="20 ns")
    attraction = df.forces.VanDerWaals(hamaker="5e-21 J")
    found, relaxed = (df.dwell(soft([model, attraction], method="transient"), "16 nm") for model in (fast, elastic))
    # what is left of the memory is some tau / contact time = 0.6 %
    assert float(found.amplitude[0]) == pytest.approx(float(relaxed.amplitude[0]), rel=0.01)
    assert float(found.peak_force) == pytest.approx(float(relaxed.peak_force), rel=0.02)


@pytest.mark.timeout(120)
def test_a_tip_that_hysteretic_adhesion_holds_takes_no_integrator_for_ever():
    """At each turn the adhesion changes, and holds the tip: the branch would switch without end."""
    case = df.Case(
        cantilever=df.Cantilever(f0="225 kHz", k="1.5 N/m", Q=750), drive=df.Drive(A0="1.85 nm"),
        tip=df.Tip(radius="12.8 nm"), sample=df.Sample(youngs_modulus="28 MPa"),
        forces=[
            df.forces.AdhesionHysteresis(approach_energy="29 mJ/m^2", retract_energy="48 mJ/m^2"), df.forces.Hertz()
        ],
    )  # fmt: skip
    deflections = []
    for name in ("rk4", "engine"):
        ready, motion = reached(case.problem, name, 1.805e-9, "rest", 2)
        deflections.append(ready.record(motion)[1][:-1, 0])
    held, reference = (deflection.mean() for deflection in deflections)
    # in free amplitudes; each integrator lets the branch rest after some switches, and the tip creeps by 1e-4 a period
    assert held == pytest.approx(reference, abs=5e-4)
    assert max(np.ptp(deflection) for deflection in deflections) < 1e-3
