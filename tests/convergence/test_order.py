"""The order of each integrator, measured: errors after four periods against the adaptive one at its tightest.

Errors are root mean squares over distances, since where a kink falls within a step is a matter of chance.
"""

from functools import cache

import numpy as np
import pytest

import dforce as df
from dforce.problem import Problem
from dforce.solvers.integrator import INTEGRATORS, free_amplitudes, with_amplitudes

DISTANCES = np.linspace(4.1e-9, 7.7e-9, 12)
POINTS = np.array([32, 64, 128, 256, 512, 1024])
SMOOTH = [10.6e-9, 10.8e-9, 11e-9]  # the tip stays outside contact


@cache
def problem(name):
    drag = {"root": 100.0, "none": 0.0}.get(name, 0.0)
    forces = {
        "smooth": [df.forces.DMT(hamaker="2e-20 J")],
        "spring": [df.forces.Sneddon(geometry="punch")],
        "hertz": [df.forces.DMT(hamaker="0 J")],
        "jump": [df.forces.VanDerWaals(hamaker="2e-20 J", inside="off"), df.forces.Hertz()],
    }.get(name, [df.forces.DMT(hamaker="0 J"), df.forces.KelvinVoigt(viscosity=drag)])
    # Q = 2, so that RK4 takes as few points as asked for
    return Problem.build(
        df.Cantilever(f0="50 kHz", k="0.9 N/m", Q=2), df.Drive(A0="10 nm"), df.Tip(radius="2 nm"),
        df.Sample(youngs_modulus="20 MPa" if name in ("spring", "root") else "1 GPa"), forces=forces,
    )  # fmt: skip


def ends(name, **settings):
    """Return the scaled motion after four periods from the free one, at each distance."""
    chosen = df.SolverSettings(method="transient", **settings)
    integrator = INTEGRATORS[chosen.integrator](problem(name), chosen, 1)
    found = []
    for zc in SMOOTH if name == "smooth" else DISTANCES:
        integrator.place(float(zc))
        motion, _ = integrator.lock_in(with_amplitudes(integrator, free_amplitudes(integrator)), 4)
        found.append(motion.y)
    return np.array(found)


@cache
def exact(name):
    return ends(name, integrator="adaptive", relative_tolerance=1e-13, points_per_period=64)


def error(name, **settings):
    return float(np.sqrt(((ends(name, **settings) - exact(name)) ** 2).mean()))


def order(sizes, errors):
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])


@pytest.mark.parametrize("name", ["smooth", "spring"])
def test_rk4_is_of_fourth_order_also_where_the_force_has_a_kink(name):
    errors = [error(name, integrator="rk4", points_per_period=int(n)) for n in POINTS]
    assert -order(POINTS, errors) == pytest.approx(4.0, abs=0.1)


@pytest.mark.parametrize(("name", "power"), [("hertz", 2.5), ("jump", 2.5), ("root", 1.5)])
def test_rk4_is_limited_by_a_force_that_starts_like_a_root_not_by_its_kinks_or_jumps(name, power):
    """Hertz' force starts like depth^1.5, and a step that starts there errs by h^2.5; viscous drag, depth^0.5: h^1.5.

    A jump of the force adds nothing to that, because steps are cut there; uncut it would leave order 1.
    """
    points = POINTS[1:]
    errors = [error(name, integrator="rk4", points_per_period=int(n)) for n in points]
    assert power - 0.3 < -order(points, errors) < power + 1.2  # steeper while the smooth part's error still counts


@pytest.mark.parametrize("name", ["smooth", "spring", "hertz", "jump", "root"])
def test_adaptive_errors_are_proportional_to_the_tolerance(name):
    tolerances = np.array([1e-7, 1e-8, 1e-9, 1e-10, 1e-11])
    errors = [error(name, integrator="adaptive", relative_tolerance=t, points_per_period=16) for t in tolerances]
    assert order(tolerances, errors) == pytest.approx(1.0, abs=0.15)
    assert errors[-1] < 1e-9


def test_adaptive_steps_are_of_fifth_order():
    """With a loose tolerance the samples set the steps: halved, the error falls by 2^5."""
    points = np.array([32, 48, 64, 96, 128])
    errors = [error("smooth", integrator="adaptive", relative_tolerance=1e-3, points_per_period=int(n)) for n in points]
    assert -order(points, errors) == pytest.approx(5.0, abs=0.2)


def test_lsoda_errors_fall_with_its_tolerance():
    tolerances = np.array([1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10])
    errors = [error("root", integrator="lsoda", relative_tolerance=t, points_per_period=32) for t in tolerances]
    # its order changes on the way: a power of the tolerance near 1, and never above a thousand times the tolerance
    assert order(tolerances, errors) == pytest.approx(1.0, abs=0.25)
    assert all(error < 1e3 * t for error, t in zip(errors, tolerances, strict=True))
