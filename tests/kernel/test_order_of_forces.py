"""The order in which a case lists its forces changes nothing but the order in which they are shown."""

import itertools

import numpy as np
import pytest

import dforce as df
from dforce.kernel.codegen import compose
from dforce.maps._grid import ProblemGrid
from dforce.maps.axes import make_axes
from dforce.solvers.problem_batch import ProblemBatch
from dforce.validity._evidence import Evidence

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

F = df.forces
SOFT = "1e-3*indentation*exp(-d*1e9)"
MIXED = (  # a memory, a branch, two of one model, and a plain law
    F.SLS(**F.SLS.example), F.Capillary(volume="100 nm^3"), F.Custom(law=SOFT), F.Custom(law="P1*d", P1=1e-3),
    F.VanDerWaals(hamaker="1e-20 J"),
)  # fmt: skip
OF_THREE = (
    F.SLS(**F.SLS.example),
    F.Custom(law="-P1*exp(-max(d, a0)/P2)", P1=2e-10, P2=5e-10),
    F.Hydration(**F.Hydration.example),
)


def case(forces, **changes):
    values = {
        "cantilever": df.Cantilever(f0="50 kHz", k="1 N/m", Q=100),
        "drive": df.Drive(A0="8 nm"),
        "tip": df.Tip(radius="5 nm"),
        "sample": df.Sample(youngs_modulus="1 GPa", poisson_ratio=0.3),
        "experiment": df.experiments.Dwell(zc="7 nm"),
    }
    return df.Case(**values | changes, forces=list(forces))


def test_every_order_of_the_forces_is_the_same_kernel():
    texts = {compose(1, case(order).problem.forces, {}) for order in itertools.permutations(MIXED)}
    assert len(texts) == 1


def test_every_order_of_the_forces_gives_the_same_numbers_to_the_last_bit():
    # a sum of three terms in another order differs in its last bit somewhere along the motion
    one, other = (df.run(case(forces)) for forces in (OF_THREE, OF_THREE[::-1]))
    assert set(one.data_vars) == set(other.data_vars)
    for name in one.data_vars:
        np.testing.assert_array_equal(one[name].values, other[name].values, err_msg=str(name))


def test_the_share_of_each_force_is_listed_as_in_the_case():
    ways = [df.force_curve(case(forces), distance=np.linspace(3e-9, 0.0, 7)) for forces in (OF_THREE, OF_THREE[::-1])]
    for curve, forces in zip(ways, (OF_THREE, OF_THREE[::-1]), strict=True):
        assert list(curve.model.values) == [force.name for force in forces]
    np.testing.assert_array_equal(ways[0].force.values, ways[1].force.values)
    for name in ways[0].model.values:
        shares = [way.partial_force.sel(model=name).values for way in ways]
        np.testing.assert_array_equal(*shares)
    assert len({float(abs(share).max()) for share in ways[0].partial_force.values}) == 3  # they can be told apart


def test_two_of_one_model_keep_their_numbers_in_labels_and_paths():
    for laws in (["2*d", "d"], ["d", "2*d"]):
        chosen = case([F.Custom(law=law) for law in laws])
        curve = df.force_curve(chosen, distance=[2e-9, 1e-9])
        assert list(curve.model.values) == ["custom_1", "custom_2"]
        factors = [2.0 if law == "2*d" else 1.0 for law in laws]
        np.testing.assert_allclose(curve.partial_force.values[:, 0, 0], np.array(factors) * 2e-9)
        seen = Evidence(chosen, None)
        paths = {force.law: seen.path(force, "law") for force in seen.problem.forces}
        assert paths == {law: f"forces.{place}.law" for place, law in enumerate(laws, start=1)}


@pytest.mark.parametrize("laws", [["P1*d", "P1*d + 1e-9*P2"], ["P1*d + 1e-9*P2", "P1*d"]])
def test_a_sweep_changes_the_force_that_its_path_names(laws):
    """One of the laws swept over comes before the other force's, one behind it."""
    base = case([F.Custom(law=laws[0], P1=1.0, P2=0.5), F.Custom(law="P1*d + P2*1e-12", P1=2.0, P2=0.25)])
    over = {"forces.1.law": [laws[0], "P1*d + P2*2e-12"], "forces.2.P1": [3.0, 4.0], "forces.1.P2": [0.1, 0.2]}
    grid = ProblemGrid(base, make_axes(base, over))
    for number, values in enumerate(itertools.product(*over.values())):
        one = base
        for path, value in zip(over, values, strict=True):
            one = one.replace(path, value)
        wanted = one.problem
        assert grid.problem(number).forces == wanted.forces
        if grid.alike:
            np.testing.assert_array_equal(grid.batch(np.array([number])).numbers, ProblemBatch.of([wanted]).numbers)
