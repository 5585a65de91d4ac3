"""Every force in a tapping run: energy is accounted for, and memory and branches go through every solver alike."""

import math

import numpy as np
import pytest

import dforce as df
from dforce import kernel
from dforce.experiments._experiment import initial_motion
from dforce.forces import REGISTRY
from dforce.kernel.compose import compose
from dforce.observables.measure import F, F_V, FIRST, Z, measure
from dforce.problem import Problem
from dforce.solvers._loops import phases
from dforce.solvers.adaptive import advance
from dforce.solvers.integrator import INTEGRATORS

TAU = 2 * math.pi
# twelve decay times of a lever with Q = 5: the free motion has died out to 1e-16, and the memory below with it
PERIODS = 60
# A contact of rigid bodies lasts 1.5 % of the period; between 256 samples of it the cubic misses 3e-5 of the energy
SAMPLES = {"lennard_jones": 1024, "morse": 1024}
# relaxation times that end within the run, and a modulus that a stiff lever feels
CHANGES = {"power_law": {"modulus_at_reference": "300 MPa", "reference_time": "1 us", "longest_time": "10 us"}}


def lever(force):
    """Return a lever so stiff that no neck or adhesion holds it: its spring pulls back with k A0 = 100 nN."""
    return Problem.build(
        df.Cantilever(f0=50e3, k=5.0, Q=5.0),
        df.Drive(A0=20e-9),
        df.Tip(radius=10e-9, youngs_modulus=170e9, poisson_ratio=0.28, half_angle="20 deg"),
        df.Sample(youngs_modulus=1e9, poisson_ratio=0.3, thickness=500e-9, radius=50e-9),
        medium=df.Medium(temperature=298.15, permittivity=78.5),
        forces=[force],
    )


def go_on(
    y, memory, latched, periods, points, tones, bases, kinks, tolerance, sizes, work, block, p
):  # fmt: skip
    for i in range(periods):
        phases(tones, i, bases)
        y = advance(y, memory, latched, i, points, tones, bases, kinks, tolerance, sizes, work, block, p)
    return y


def plain(text):
    """Return the functions of a composed module, uncompiled: one period is measured faster than `measure` compiles."""
    functions = {}
    exec(text.replace("from numba import njit", "njit = lambda **options: lambda function: function"), functions)
    return functions


@pytest.mark.parametrize("name", sorted(REGISTRY))
def test_what_the_drive_gives_is_what_cantilever_and_sample_take(name):
    model = REGISTRY[name]
    problem = lever(model(**{**model.example, **CHANGES.get(name, {})}))
    points = SAMPLES.get(name, 256)
    settings = df.SolverSettings(method="transient", integrator="adaptive", points_per_period=points)
    ready = INTEGRATORS["adaptive"](problem, settings, 60)
    ready.place(16e-9)
    start = initial_motion(ready, "free")
    entries = {"go_on": go_on, "measure": measure}
    bases = np.zeros(1)
    end = kernel.load(problem, entries).entry("go_on")(
        start.y, start.memory, start.latched, PERIODS, points, ready.tones, bases, ready.kinks,
        settings.relative_tolerance, ready.sizes, ready.work, ready.block, ready.p,
    )  # fmt: skip
    assert end == pytest.approx(ready.block[0, :2], abs=1e-8)  # periodic: nothing is left over at the end of a period
    row = np.empty(ready.columns)
    text = compose(1, problem.forces, entries)
    plain(text)["measure"](
        ready.block, PERIODS - 1, points, ready.tones, bases, ready.p, ready.kinks, 60, row
    )
    mode, tone, length = problem.modes[0], problem.tones[0], ready.scales.length
    total = length * complex(*row[FIRST + 2 : FIRST + 4])
    given = -math.pi * tone.force * total.imag
    harmonics = length * np.abs(row[FIRST + 4 : FIRST + 124 : 2] + 1j * row[FIRST + 5 : FIRST + 125 : 2])
    damping = mode.k / (TAU * mode.f0 * mode.Q)  # m w0 / Q
    mean_square = (ready.block[:-1, 1] ** 2).mean() * ready.scales.speed**2
    taken = -row[F_V] / tone.frequency
    # PHYSICS 5.4 and 5.10: 1e-5 of pi F0 A, with the damping from the velocity and from the harmonics
    scale = math.pi * tone.force * abs(total)
    assert taken == pytest.approx(given - damping * mean_square / tone.frequency, abs=1e-5 * scale)
    squares = (np.arange(1, 61) ** 2 * harmonics**2).sum()
    assert taken == pytest.approx(given - math.pi * mode.k / mode.Q * squares, abs=1e-5 * scale)
    # 5.1: the mean force bends the lever
    assert row[F] == pytest.approx(mode.k * row[Z] * length, abs=1e-5 * tone.force)
    if model.dissipative:
        assert taken > 1e-4 * scale  # so that the balance says something of the loss
    else:
        assert abs(taken) < 1e-5 * scale
