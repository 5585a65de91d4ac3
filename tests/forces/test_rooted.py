"""Which laws begin like a root at a kink: their steps are graded there."""

import pytest

import dforce as df

SAMPLE = df.Sample(youngs_modulus="1 GPa")


def bound(force: df.Force) -> df.Force:
    """Return the force as a problem of a usual instrument has it."""
    case = df.Case(
        cantilever=df.Cantilever(f0="50 kHz", k=1.0, Q=100.0),
        drive=df.Drive(A0="8 nm"),
        tip=df.Tip(radius="5 nm"),
        sample=SAMPLE,
        forces=[force],
    )
    return case.problem.forces[0]


@pytest.mark.parametrize(
    "force",
    [
        df.forces.KelvinVoigt(viscosity="10 Pa s"),
        df.forces.JKR(surface_energy="20 mJ/m^2"),
        df.forces.Custom(law="P1*indentation**0.5", P1=1e-6),
    ],
    ids=["kelvin_voigt", "jkr", "custom"],
)
def test_a_law_that_begins_like_a_root_is_found(force: df.Force) -> None:
    assert bound(force).is_rooted


@pytest.mark.parametrize(
    "force",
    [
        df.forces.Hertz(),
        df.forces.DMT(hamaker="2e-20 J"),
        df.forces.VanDerWaals(hamaker="2e-20 J", inside="off"),
        df.forces.Custom(law="P1*indentation", P1=1.0),
    ],
    ids=["hertz", "dmt", "jumps", "custom"],
)
def test_laws_with_a_slope_or_a_jump_at_their_kink_are_none(force: df.Force) -> None:
    assert not bound(force).is_rooted
