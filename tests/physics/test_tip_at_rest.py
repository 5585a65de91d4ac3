"""A tip that rests where the force jumps, because both sides drive it back there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import dforce as df
from dforce.results.status import Status

F0, K, Q, A0, RADIUS, HAMAKER, CONTACT, MODULUS = 50e3, 2.0, 300.0, 3e-9, 10e-9, 1e-19, 0.165e-9, 1e9
PULL = HAMAKER * RADIUS / (6.0 * CONTACT**2)  # N, the attraction where it ends


def soft_lever(**changes: str) -> df.Case:
    """Return a curve to and fro over an attraction that ends at contact, with some other values."""
    case = df.Case(
        cantilever={"f0": F0, "k": K, "Q": Q},
        drive={"A0": A0},
        tip={"radius": RADIUS},
        sample={"youngs_modulus": MODULUS, "poisson_ratio": 0.3},
        forces=[{"model": "van_der_waals", "hamaker": HAMAKER, "inside": "off"}, {"model": "hertz"}],
        experiment={"kind": "approach", "direction": "both", "zc": {"start": 4.6e-9, "stop": 0.3e-9, "points": 21}},
    )
    for path, value in changes.items():
        case = case.replace(path.replace("__", "."), value)
    return case


def farthest_from_contact(zc: float, periods: int) -> float:
    """Return how far (m) a tip that starts at rest at contact comes from there, by SciPy; the jump is smooth over 1 pm."""
    stiff, omega = 4.0 / 3.0 * MODULUS / (1.0 - 0.3**2) * math.sqrt(RADIUS), 2.0 * math.pi * F0

    def change(t: float, y: list[float]) -> list[float]:
        d = zc + y[0]
        outside = 0.5 * (1.0 + math.tanh((d - CONTACT) / 0.5e-12))
        force = stiff * max(CONTACT - d, 0.0) ** 1.5 - outside * PULL * (CONTACT / max(d, 0.5 * CONTACT)) ** 2
        drive = K * A0 / Q * math.cos(omega * t)
        return [y[1], omega * omega / K * (force + drive - K * y[0]) - omega / Q * y[1]]

    start, step = [CONTACT - zc, 0.0], 0.02 / F0
    found = solve_ivp(change, (0.0, periods / F0), start, "Radau", rtol=1e-8, atol=[1e-15, 1e-10], max_step=step)
    return float(np.abs(zc + found.y[0] - CONTACT).max())


def test_tip_rests_on_the_sample_until_the_spring_pulls_it_off() -> None:
    curve = df.run(soft_lever())
    away = curve.sel(direction="retract")
    stuck = away["zc"].values[away["status"].values == Status.UNRESOLVED]
    assert any("rest where the force van_der_waals jumps" in one.text for one in df.advice(curve))
    limit = CONTACT + (PULL - K * A0 / Q) / K  # the spring and the drive against the attraction
    step = float(curve["zc"][0] - curve["zc"][1])
    assert (
        limit - 2.0 * step < stuck.max() < limit
    )  # bounces by the steps of the integration pull it off a little early
    beyond = stuck.max() + step
    assert farthest_from_contact(float(stuck.max()), 5) < 5e-12
    assert farthest_from_contact(max(beyond, limit), 5) > 1e-9


@pytest.mark.parametrize("k", ["0.1 N/m", "0.5 N/m"])
def test_tip_at_rest_costs_no_more_samples(k: str) -> None:
    curve = df.run(soft_lever(cantilever__k=k))
    assert (curve["status"].values == Status.UNRESOLVED).any()
    assert curve.attrs["samples_per_period"] == 256  # the first number: more do not help a tip at rest
