"""Every force in the folder passes the common checks, and the checks see what they are for."""

import importlib
import inspect
import pkgutil
from math import sqrt
from typing import Literal

import numpy as np
import pydantic
import pytest

import dforce.forces
from dforce.checks.battery import INSTRUMENT, check_force
from dforce.core.errors import ForceError, ParameterError
from dforce.core.parameters import param, shared
from dforce.forces import REGISTRY, Force

SHIPPED = {name: model for name, model in REGISTRY.items() if model.__module__.startswith("dforce.forces.")}


def forces_in_the_folder() -> dict[str, type[Force]]:
    found = {}
    for file in pkgutil.iter_modules(dforce.forces.__path__):
        module = importlib.import_module(f"dforce.forces.{file.name}")
        for name, thing in vars(module).items():
            here = inspect.isclass(thing) and thing.__module__ == module.__name__
            if here and issubclass(thing, Force) and thing is not Force:
                found[f"{file.name}.{name}"] = thing
    return found


@pytest.mark.parametrize("model", SHIPPED.values(), ids=SHIPPED.keys())
@pytest.mark.slow
def test_every_force_passes_the_battery(model):
    check_force(model)


def test_no_force_in_the_folder_escapes_the_battery():
    escaped = [
        place
        for place, model in forces_in_the_folder().items()
        if model not in SHIPPED.values() and not is_shared_machinery(model)
    ]
    assert not escaped


def is_shared_machinery(model: type[Force]) -> bool:
    """Return whether a class without a name is there for forces that are registered."""
    families = model.__module__.rsplit(".", 1)[-1].startswith("_")
    return families and not model.name and any(issubclass(shipped, model) for shipped in SHIPPED.values())


def test_each_file_holds_one_force_that_is_exported_under_its_class_name():
    files = [file.name for file in pkgutil.iter_modules(dforce.forces.__path__) if not file.name.startswith("_")]
    assert sorted(files) == sorted(SHIPPED)
    for model in SHIPPED.values():
        assert getattr(dforce.forces, model.__name__) is model


@pytest.fixture
def registry():
    yield
    REGISTRY.pop("tried", None)


def problems(model):
    with pytest.raises(ForceError) as caught:
        check_force(model)
    return str(caught.value)


def spring(law, **members):
    """Return a new force with the given law and members."""
    body = {
        "__doc__": "A spring. .. math:: F = k (a_0 - d)",
        "__module__": __name__,
        "__annotations__": {"stiffness": float, "a0": float},
        "name": "tried",
        "source": "this test",
        "stiffness": param("1 N/m", symbol="k", low="0 N/m", doc="spring constant"),
        "a0": shared("contact.a0"),
        "law": staticmethod(law),
        **members,
    }
    return type("Tried", (Force,), body)


def in_contact(d, rate, t, stiffness, a0):
    return stiffness * (a0 - d) if d < a0 else 0.0


def kinks(self):
    return (self.a0,)


def test_a_sound_force_passes(registry):
    check_force(spring(in_contact, kinks=kinks))


def test_an_undeclared_kink_is_found(registry):
    assert "not smooth at d = 1.65" in problems(spring(in_contact))


def test_an_undeclared_jump_is_found(registry):
    def law(d, rate, t, stiffness, a0):
        return 1e-10 * stiffness if d < a0 else 0.0

    assert "declare the jump" in problems(spring(law, kinks=kinks))
    REGISTRY.pop("tried")
    assert "not smooth" in problems(spring(law))


def test_a_law_that_is_not_finite_is_found(registry):
    def division(d, rate, t, stiffness, a0):
        return stiffness / d

    def root(d, rate, t, stiffness, a0):
        return stiffness * sqrt(d)

    assert "fails at d = 0.0" in problems(spring(division))
    REGISTRY.pop("tried")
    assert "fails at d = -1.0" in problems(spring(root))


def test_a_potential_of_another_force_is_found(registry):
    def potential(d, stiffness, a0):
        return stiffness * (a0 - d) ** 2 if d < a0 else 0.0  # twice too large

    assert "potential's slope" in problems(spring(in_contact, kinks=kinks, potential=staticmethod(potential)))


def test_a_hidden_dissipation_and_a_source_of_energy_are_found(registry):
    def drag(d, rate, t, stiffness, a0):
        return -stiffness * rate

    def push(d, rate, t, stiffness, a0):
        return stiffness * rate

    assert "set dissipative" in problems(spring(drag))
    REGISTRY.pop("tried")
    assert "adds" in problems(spring(push, dissipative=True))


HIDDEN = {"value": 1.0}


def test_a_law_that_reads_something_changeable_is_found(registry):
    def law(d, rate, t, stiffness, a0):
        return HIDDEN["value"] * stiffness * a0

    assert "can change" in problems(spring(law))


TABLE = np.array([1.0, 2.0])


def test_an_array_that_a_law_reads_must_be_read_only(registry):
    def law(d, rate, t, stiffness, a0):
        return -stiffness * (d - a0) * TABLE[0] if d < a0 else 0.0

    model = spring(law, kinks=kinks)
    assert "TABLE.flags.writeable = False" in problems(model)
    TABLE.flags.writeable = False
    check_force(model)


def test_a_law_with_a_closure_is_found(registry):
    kept = 1.0

    def law(d, rate, t, stiffness, a0):
        return kept * stiffness * a0

    assert "closure" in problems(spring(law))


def test_missing_declarations_are_found(registry):
    found = problems(spring(in_contact, kinks=kinks, __doc__="A spring.", source=""))
    assert "no equation" in found
    assert "source" in found


def test_a_law_must_take_its_own_fields(registry):
    def law(d, rate, t, stifness, a0):
        return 0.0

    with pytest.raises(ForceError, match="takes 'stifness', neither a field nor a property"):
        spring(law)


def with_states(law, evolve, **members):
    """Return a new force with a memory."""
    return spring(law, evolve=staticmethod(evolve), kinks=kinks, dissipative=True, memory_scale=1.0, **members)


def test_a_memory_of_another_size_is_found(registry):
    def law(d, rate, t, memory, stiffness, a0):
        return in_contact(d, rate, t, stiffness, a0) + 0.0 * memory[0]

    def of_two(d, rate, t, memory, stiffness, a0):
        return law(d, rate, t, memory, stiffness, a0) + 0.0 * memory[1]

    def evolve(d, rate, t, memory, change, stiffness, a0):
        change[0], change[1] = -memory[0], -memory[1]

    def of_one(d, rate, t, memory, change, stiffness, a0):
        change[0] = -memory[0]

    for function in (law, of_two):
        assert "more states than memory = 1" in problems(with_states(function, evolve, memory=1))
        REGISTRY.pop("tried")
    assert "writes 1 of its memory = 2 states" in problems(with_states(law, of_one, memory=2))


def test_a_memory_and_its_evolution_belong_together(registry):
    def law(d, rate, t, memory, stiffness, a0):
        return memory[0]

    def evolve(d, rate, t, memory, change, stiffness, a0):
        change[0] = -memory[0]

    with pytest.raises(ForceError, match="'tried' has 'evolve', but no memory"):
        with_states(law, evolve)
    with pytest.raises(ForceError, match="'tried' has a memory, but no 'evolve'"):
        spring(in_contact, memory=2)


def test_an_unknown_interaction_is_refused_with_the_nearest(registry):
    with pytest.raises(ForceError, match="did you mean 'van der Waals'"):
        spring(in_contact, contains=("van der Wals",))


def test_a_choice_that_fails_is_found(registry):
    class Tried(Force):
        """A choice. .. math:: F = c"""

        name = "tried"
        source = "this test"
        shape: Literal["round", "sharp"] = pydantic.Field("round", description="the shape")

        @property
        def size(self):
            """Size (1)."""
            return float("nan") if self.shape == "sharp" else 1.0

        @staticmethod
        def law(d, rate, t, size):
            return size

    assert "not finite" in problems(Tried)


def test_what_the_instrument_lacks_is_named():
    with pytest.raises(ParameterError, match=r"hertz needs tip\.radius, which is missing"):
        dforce.forces.Hertz().bind({**INSTRUMENT, "tip.radius": None})
    with pytest.raises(ParameterError, match=r"van_der_waals needs tip\.half_angle"):
        dforce.forces.VanDerWaals(hamaker=1e-20, geometry="capped_cone").bind({**INSTRUMENT, "tip.half_angle": None})


def test_an_unknown_model_is_answered_with_the_nearest():
    with pytest.raises(AttributeError, match="did you mean 'Hertz'"):
        _ = dforce.forces.Herz
