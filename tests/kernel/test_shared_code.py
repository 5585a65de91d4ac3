"""Most code is compiled once for all forces: it calls their laws by address."""

import numpy as np
import pytest

import dforce as df
from dforce import kernel
from dforce.kernel import cache
from dforce.problem import Problem
from dforce.solvers.compiled import CALLED, LANES, SHARED, TipFunctions, load_kernels

CASE = df.example("figure-3-air")


def addresses(*forces, names=("advance_lanes", *SHARED)):
    """Return by name where the functions lie that the solvers call for these forces."""
    problem: Problem = CASE.replace(forces=list(forces)).problem
    tip = TipFunctions(load_kernels(problem)[0], problem)
    values = tip.at(kernel.parameters(problem, 1e-8), names)[-len(CALLED) :]
    return {name: at for name, at in zip(CALLED, values, strict=True) if name in names}


def test_what_measures_and_what_cuts_steps_is_the_same_code_for_all_forces():
    hertz, dmt = addresses(df.forces.Hertz()), addresses(df.forces.DMT(hamaker="6e-20 J"))
    assert {name for name in hertz if hertz[name] == dmt[name]} == set(SHARED)
    assert hertz["advance_lanes"] != dmt["advance_lanes"] and "advance_lanes" in LANES


def test_plain_steps_are_the_same_code_whatever_drives_the_lever():
    shaken = CASE.replace("drive.excitation", "base")
    assert shaken.problem.lagging and not CASE.problem.lagging
    assert load_kernels(shaken.problem)[0] is load_kernels(CASE.problem)[0]


def test_what_cuts_and_measures_is_the_same_code_for_any_number_of_states():
    two, four, neck = df.forces.SLS(), df.forces.SLS(elements=4), df.forces.Capillary()
    found = [addresses(*forces, names=["cut", "measure_force"]) for forces in ([two], [four], [two, neck])]
    for name in ("cut", "measure_force"):
        assert len({there[name] for there in found}) == 1


@pytest.mark.slow  # two laws are compiled
def test_a_law_that_is_new_compiles_the_plain_steps_and_itself_alone(monkeypatch):
    compiled, usual = [], cache.one_at_a_time

    def told(module, function):
        compiled.append(function)
        return usual(module, function)

    for functions in np.random.default_rng().choice(["sin", "cos", "exp", "tanh"], (2, 10)):  # never compiled before
        law = df.forces.Custom(law=f"P1 * exp(-d / P2) + P3 * ({' + '.join(f'{f}(-d / P2)' for f in functions)})",
                               P1=1e-9, P2=1e-9, P3=1e-13)  # fmt: skip
        df.approach(CASE.replace(forces=[law]), zc={"start": "12 nm", "stop": "9 nm", "points": 5})
        monkeypatch.setattr(cache, "one_at_a_time", told)  # from the second on: the first may compile the solvers
    assert sorted(compiled) == ["advance_lanes", "each_force_at", "force_at"]
