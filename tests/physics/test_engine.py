"""The engine: its motions against SciPy alone, its derivatives against differences, its sums against samples."""

import importlib
import math

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher
from witness import Witness

import dforce as df
from dforce import kernel
from dforce.engine.marching import ENGINE, Marcher, Start
from dforce.problem import Instrument, Problem

HARMONICS = 300  # a tap of rigid bodies turns the tip within 1 % of the period
TIGHT = (1e-11, 1e-6, 1e-9)
STIFF = {"f0": 300e3, "k": 40.0, "Q": 400.0}
SOFT = {"f0": 30e3, "k": 0.5, "Q": 2.0}


def lever(forces, modes=(STIFF,), modulus=2e9, **drive):
    return Problem.build(
        Instrument(
            df.Cantilever(modes=list(modes)),
            df.Drive(**({"A0": 20e-9} | drive)),
            df.Tip(radius=10e-9, half_angle="20 deg"),
            df.Sample(youngs_modulus=modulus, poisson_ratio=0.3, thickness=500e-9, radius=50e-9),
            medium=df.Medium(temperature=298.15, permittivity=78.5),
        ),
        forces=forces,
    )


def start_of(problem, zc, x, count=1):
    numbers = np.array([kernel.parameters(problem, zc)] * count)
    tones = np.array([kernel.tone_table(problem)] * count)
    kinks = np.unique(np.append(kernel.kink_distances(problem), problem.a0))
    memory = sum(force.memory for force in problem.forces)
    latches = sum(force.switch is not None for force in problem.forces)
    return Start(
        numbers,
        tones,
        np.tile(kinks, (count, 1)),
        np.atleast_2d(x),
        np.zeros((count, memory)),
        np.zeros((count, latches)),
    )


class Pull(df.Force):
    """Pulls where the tip is below a level that falls, until it is above one that rises."""

    @staticmethod
    def law(d, rate, t, latched):
        return -8e-8 if latched > 0.5 else 0.0

    @staticmethod
    def switch(latched, d, rate, t):
        return d + 1e-8 - 1e-2 * t if latched > 0.5 else 1.75e-8 - 1e-2 * t - d


DMT, DRAG = df.forces.DMT(hamaker=6e-20), df.forces.KelvinVoigt(viscosity=20.0)
TAPPING = {
    "Hertz": [df.forces.Hertz()],
    "DMT and drag": [DMT, DRAG],
    "JKR": [df.forces.JKR(surface_energy=0.02)],
    "a jump at contact": [df.forces.VanDerWaals(hamaker=1e-20, inside="off"), df.forces.Hertz()],
    "a switch that depends on time": [df.forces.Hertz(), Pull()],
    "a law that jumps with the sign of the velocity": [
        df.forces.Hertz(),
        df.forces.Custom(law="-P1*exp(-max(d, a0)/P2)*(1 if velocity < 0 else 3)", P1=5e-8, P2=1e-9),
    ],
}


@pytest.mark.parametrize("name", TAPPING)
def test_derivatives_are_those_of_the_map(name):
    """Of a period with a tap: JKR snaps into contact and off, so neighbors meet jumps of the force at other times."""
    problem, zc, h = lever(TAPPING[name]), 12e-9, 1e-6
    x = np.array([0.62 * math.cos(0.4), 0.62 * math.sin(0.4)])
    marcher, unit = Marcher.of(problem), problem.tones[0].A0
    found = marcher.march(start_of(problem, zc, x), 1, TIGHT, unit=np.array([unit]))
    columns = []
    for k in range(3):
        moved = np.zeros((2, 3))
        moved[:, k] = h, -h
        ends = [
            marcher.march(start_of(problem, zc + way[2] * unit, x + way[:2]), 1, TIGHT).path[0, -1] for way in moved
        ]
        columns.append((ends[0] - ends[1]) / (2.0 * h))
    assert found.columns[0] == pytest.approx(np.array(columns).T, abs=1e-3)
    taps = marcher.march(start_of(problem, zc, x), 1, TIGHT, harmonics=1).rows[0, 0, 4]
    assert taps > 0.01  # the period has a tap


def test_a_switch_that_depends_on_time_is_met_when_scipy_meets_it():
    problem, zc = lever(TAPPING["a switch that depends on time"]), 12e-9
    witness, x = Witness(problem, zc), np.array([0.62 * math.cos(0.4), 0.62 * math.sin(0.4)])
    expected = witness.march(x * witness.scale[:2], [0.0], 1.0 / problem.tones[0].frequency)[:2] / witness.scale[:2]
    assert Marcher.of(problem).march(start_of(problem, zc, x), 1, TIGHT).path[0, -1] == pytest.approx(
        expected, abs=1e-8
    )


def test_a_step_from_a_kink_has_the_slope_of_a_force_that_begins_like_a_root():
    """So its derivatives are as exact as asked for: viscous drag over the contact area begins like a root."""
    problem = lever([df.forces.Hertz(), DRAG])
    start, unit = start_of(problem, 12e-9, np.array([0.57, 0.24])), np.array([problem.tones[0].A0])
    rough, exact = (
        Marcher.of(problem).march(start, 1, (1e-6, limit, 1.0), unit=unit).columns for limit in (1e-4, 1e-9)
    )
    assert rough == pytest.approx(exact, abs=3e-5)


@pytest.mark.parametrize("Q", [0.51, 2.0, 1e5])
def test_a_free_lever_is_exact_at_any_step(Q):
    problem = lever([], modes=[{"f0": 50e3, "k": 1.0, "Q": Q}], frequency="47 kHz")
    found = Marcher.of(problem).march(start_of(problem, 1e-6, np.array([0.3, -0.2])), 50, (1e-3, 1.0, 1.0))
    ratio = 50.0 / 47.0
    matrix = np.array([[0.0, 1.0], [-(ratio**2), -ratio / Q]])
    free = problem.free[0, 0] / problem.tones[0].A0
    driven = np.array([free.real, -free.imag])  # at the start of each period
    values, vectors = np.linalg.eig(matrix)
    decay = (vectors * np.exp(values * 100.0 * math.pi)) @ np.linalg.inv(vectors)
    expected = driven + (decay @ (np.array([0.3, -0.2]) - driven)).real
    assert found.path[0, -1] == pytest.approx(expected, abs=1e-9)


def test_sums_over_a_period_are_those_of_its_samples():
    problem, parts = lever([DMT, DRAG]), 4096
    marcher, start = Marcher.of(problem), start_of(problem, 12e-9, np.array([0.62, 0.0]))
    row = marcher.march(start, 1, TIGHT, harmonics=6).rows[0, 0]
    found = marcher.march(start, 1, TIGHT, per_period=parts, sampled=True)
    z, force = found.path[0, :, 0], found.samples[0, :, -1]
    v = found.path[0, :, 1]
    d = 12e-9 + 20e-9 * z
    weight = np.full(parts + 1, 1.0 / parts)
    weight[[0, -1]] *= 0.5
    assert row[0] == pytest.approx((weight * z).sum(), abs=1e-7)
    assert row[1] == pytest.approx((weight * force).sum(), abs=1e-5 * np.abs(force).max())
    assert row[4] == pytest.approx((weight * (d < problem.a0)).sum(), abs=2.0 / parts)
    assert row[5] == pytest.approx(z.min(), abs=1e-6)
    assert row[6] == pytest.approx(z.max(), abs=1e-6)
    assert row[8] == pytest.approx(force.max(), rel=1e-4)
    assert row[9] == pytest.approx(d.min(), abs=1e-15)
    assert row[10] == pytest.approx(np.abs(v).max() * 2.0 * math.pi * 300e3 * 20e-9, rel=1e-6)
    turn = np.exp(-2j * math.pi * np.arange(parts + 1) / parts)
    for k in range(1, 7):
        place = 11 + 4 + 2 * (k - 1)
        assert complex(row[place], row[place + 1]) == pytest.approx(2.0 * (weight * z * turn**k).sum(), abs=1e-6), k


def test_only_what_python_calls_becomes_machine_code_by_itself():
    modules = [importlib.import_module(f"dforce.engine.{name}") for name in ENGINE]
    functions = {name: one for module in modules for name, one in vars(module).items() if isinstance(one, Dispatcher)}
    called = [name for name, one in functions.items() if not one.targetoptions.get("no_cpython_wrapper")]
    assert called == ["add_laws", "advance"]
