"""The checks that every force model must pass, your own too.

>>> check_force(dforce.forces.DMT)

In a test: ``@pytest.mark.parametrize("model", my_models)`` over :func:`check_force`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise
from typing import Any, Literal, get_args, get_origin

import numpy as np

from dforce.core.errors import ForceError, ParameterError, checked
from dforce.forces import Force, makes_its_laws
from dforce.kernel.linker import compile_function
from dforce.spectroscopy import Answer, follow

__all__ = ["INSTRUMENT", "Answer", "bound_examples", "check_force", "compile_function", "follow"]

INSTRUMENT: Mapping[str, float] = {
    "tip.radius": 10e-9,
    "tip.youngs_modulus": 170e9,
    "tip.poisson_ratio": 0.28,
    "tip.half_angle": math.radians(20.0),
    "sample.youngs_modulus": 1e9,
    "sample.poisson_ratio": 0.3,
    "sample.thickness": 500e-9,
    "sample.radius": 50e-9,
    "contact.a0": 0.165e-9,
    "contact.E_eff": 1.092e9,
    "cantilever.f0": 50e3,
    "cantilever.k": 1.0,
    "cantilever.Q": 100.0,
    "medium.temperature": 298.15,
    "medium.permittivity": 78.5,
}
"""The values of shared parameters in the checks, by path: a typical experiment, in SI."""

DISTANCES = (-1.0, -1e-6, -2e-8, -1e-9, 0.0, 1e-12, 1e-10, 0.165e-9, 0.3e-9, 1e-9, 1e-8, 1e-6, 1.0)
RATES = (0.0, 1e-3, -1e-3, 1.0)
TIMES = (0.0, 1.7e-4)
KEEP_FINITE = "keep it finite there, as max(d, a0) does"


@checked
def check_force(model: type[Force]) -> None:
    """Run every check over a force model.

    Declared: every parameter has a unit and a sentence, the docstring an equation, the model a source.
    Law: finite at every distance and at the bounds of its parameters, a function of its arguments alone, compiled equal to
    plain. It is smooth except at its declared kinks, continuous except at its declared jumps. It equals minus the slope of its
    potential, if any. Energy: conservative unless `dissipative`, and then never a source of energy over a cycle. Fields:
    through a case file and back, and through `repr` and back.

    Raises
    ------
    ForceError
        With one line for each problem found.
    """
    problems: dict[str, None] = {}
    for check in CHECKS:
        problems.update(dict.fromkeys(check(model)))
        if problems and check in (_is_finite, _rests_at_zero):
            break  # the checks after it compute with the law's values, and compiled code checks no number of a state
    if problems:
        raise ForceError("\n".join(f"{model.name or model.__name__}: {problem}" for problem in problems))


def bound_examples(model: type[Force], at_bounds: bool = False) -> list[Force]:
    """Return the model bound to a typical instrument: with its defaults, and with each of its choices.

    With `at_bounds` also at each bound of its parameters, where a law may be steep but must be finite.
    """
    given: list[dict[str, Any]] = [{}, *_choices(model), *(_bounds(model) if at_bounds else ())]
    forces = []
    for changes in given:
        try:
            forces.append(model(**{**model.example, **changes}).bind(INSTRUMENT))
        except ParameterError:
            if not changes:
                raise
            # two parameters may exclude each other: each is within its bounds, and the model refuses both together
    return forces


def _choices(model: type[Force]) -> Iterator[dict[str, Any]]:
    for name, field in model.model_fields.items():
        if get_origin(field.annotation) is Literal:
            yield from ({name: choice} for choice in get_args(field.annotation))
        elif field.annotation is bool:
            yield from ({name: choice} for choice in (True, False))


def _bounds(model: type[Force]) -> Iterator[dict[str, Any]]:
    usual = model(**model.example)
    for name, quantity in model.quantities().items():
        low, high = quantity.bounds()
        typical = getattr(usual, name)
        several = isinstance(typical, tuple)
        middle = typical[0] if several and typical else 1.0 if several or typical is None else typical
        bounds = []
        if math.isfinite(low):
            bounds.append(low if quantity.low is not None else low + 1e-3 * abs(middle - low))
        if math.isfinite(high):
            bounds.append(high if quantity.high is not None else high - 1e-3 * abs(high - middle))
        yield from ({name: (bound,) * len(typical) if several else bound} for bound in bounds)


def _is_declared(model: type[Force]) -> Iterator[str]:
    if not model.__doc__ or ".. math::" not in model.__doc__:
        yield "the docstring has no equation (.. math::)"
    if not model.source:
        yield "the source of the equation is missing"
    quantities, shared = model.quantities(), model.shared_fields()
    for name, field in model.model_fields.items():
        if name in shared:
            if shared[name] not in INSTRUMENT:
                yield f"'{name}' is shared from {shared[name]}, but no instrument has it"
            continue
        if not field.description:
            yield f"the parameter '{name}' has no sentence (doc)"
        choice = get_origin(field.annotation) is Literal or field.annotation in (bool, int, str)
        if name not in quantities and not choice:
            yield f"the parameter '{name}' has no unit; declare it with param"
    if makes_its_laws(model):
        return  # such a model checks the arguments of its laws itself
    for name in model(**model.example).arguments():
        if name not in model.model_fields:
            text = getattr(model, name).__doc__ or ""
            if "(" not in text:
                yield f"the number '{name}' needs a docstring with its unit in parentheses"


def _functions(force: Force) -> Iterator[tuple[str, Any]]:
    yield "law", force.law_function()
    for name in ("potential", "evolve", "switch"):
        function = getattr(force, name)
        if function is not None:
            yield name, function


def _uses_only_its_arguments(model: type[Force]) -> Iterator[str]:
    if makes_its_laws(model):
        return  # each of its laws is made anew
    for name, function in _functions(model(**model.example)):
        written = {model.__dict__.get(name), model.__dict__.get(function.__name__)} - {None}
        if not all(isinstance(one, staticmethod) for one in written):
            yield f"'{name}' must be a staticmethod"
        if function.__closure__:
            yield f"'{name}' keeps values in a closure; make them arguments"
        for used in function.__code__.co_names:
            value = function.__globals__.get(used)
            if isinstance(value, np.ndarray) and value.flags.writeable:
                yield f"'{name}' reads '{used}', an array that can change; write {used}.flags.writeable = False below it"
            if isinstance(value, list | dict | set):
                yield f"'{name}' reads '{used}', a value that can change; a law may read numbers and arrays of its file"


def _calls(force: Force) -> Iterator[tuple[Any, ...]]:
    rng = np.random.default_rng(1)  # any motion will do; a fixed one makes a failure repeatable
    memories: list[tuple[Any, ...]] = [()]
    if force.evolve is not None:
        random = force.memory_scale * rng.random(force.memory)
        memories = [(np.zeros(force.memory),), (random,)]
    latches = [(0.0,), (1.0,)] if force.switch is not None else [()]
    places = (*DISTANCES, *force.kinks(), *(kink + shift for kink in force.kinks() for shift in (1e-13, -1e-13)))
    for d in places:
        for rate in RATES:
            for t in TIMES:
                for memory in memories:
                    for latched in latches:
                        yield d, rate, t, *memory, *latched, *_average(force)


def _average(force: Force) -> tuple[float, ...]:
    """Return the average distance (m) for a law that takes it."""
    return (2e-9,) if "zc" in force.leading() else ()


def _is_finite(model: type[Force]) -> Iterator[str]:
    for force in bound_examples(model, at_bounds=True):
        numbers = force.values()
        if not all(map(math.isfinite, force.numbers())):
            given = dict(zip(force.arguments(), numbers, strict=True))
            yield f"{force!r} has numbers that are not finite: {given}"
            return
        for call in _calls(force):
            try:
                value = force.law_function()(*call, *numbers)
                again = force.law_function()(*call, *numbers)
            except IndexError:
                yield _has_more_states(force)
                return
            except (ArithmeticError, ValueError) as error:
                yield f"the law of {force!r} fails at d = {call[0]} m, rate = {call[1]} m/s: {error}; {KEEP_FINITE}"
                return
            if not math.isfinite(value):
                yield f"the law of {force!r} is {value} at d = {call[0]} m, rate = {call[1]} m/s; {KEEP_FINITE}"
                return
            if value != again:
                yield f"the law of {force!r} returns two values for the same arguments"
                return


def _compiles_to_the_same(model: type[Force]) -> Iterator[str]:
    force = bound_examples(model)[0]
    for name, function in _functions(force):
        if name == "evolve":
            continue
        fast = compile_function(function)
        for call in _calls(force):
            given = call
            if name == "potential":
                given = call[:1]
            elif name == "switch":
                given = (call[3 if force.evolve is None else 4], *call[:3])
            plain, quick = function(*given, *force.values()), fast(*given, *force.values())
            # a compiler may fuse a product and a sum, and where terms cancel that shows in the last digits
            if abs(plain - quick) > 1e-10 * abs(plain) + 1e-30:
                yield f"'{name}' is {quick} compiled and {plain} plain at d = {call[0]} m"
                break
    if model.evolve is not None:
        fast = compile_function(model.evolve)
        for call in _calls(force):
            changes = np.zeros((2, force.memory))
            for change, function in zip(changes, (model.evolve, fast), strict=True):
                function(*call[:4], change, *force.values())
            if not np.allclose(changes[0], changes[1], rtol=1e-10, atol=1e-30):
                yield f"'evolve' differs compiled and plain at d = {call[0]} m"
                break


def _frozen_branches(force: Force) -> Iterator[Callable[[float], float]]:
    """Yield the law as a function of the distance, on each of its branches, at rest and moving."""
    numbers = force.values()
    # many states make the plain law slow, and this check asks for it often
    law = force.law_function() if force.evolve is None else compile_function(force.law_function())
    memory = (np.zeros(force.memory),) if force.evolve is not None else ()
    average = _average(force)
    for latched in [(0.0,), (1.0,)] if force.switch is not None else [()]:
        for rate in (0.0, -1e-3):

            def along(d: float, rate: float = rate, rest: tuple[object, ...] = (*memory, *latched)) -> float:
                return law(d, rate, 0.0, *rest, *average, *numbers)

            yield along


def _is_smooth_but_for_its_kinks(model: type[Force]) -> Iterator[str]:
    for force in bound_examples(model):
        declared, jumps = force.kinks(), force.jumps()
        if not set(jumps) <= set(declared):
            yield f"{force!r} declares a jump that is not among its kinks"
        for along in _frozen_branches(force):
            grid = np.unique(
                np.concatenate([np.linspace(-3.1e-9, 5.3e-9, 160), np.geomspace(5.3e-9, 2e-7, 40), declared])
            )
            scale = max(abs(along(float(d))) for d in grid)
            for kink in declared:
                step = abs(along(kink + 1e-19) - along(kink - 1e-19))
                if kink not in jumps and step > 1e-3 * scale:
                    yield f"the law of {force!r} jumps at its kink d = {kink} m; declare the jump"
            for low, high in pairwise(map(float, grid)):
                place = _kink_between(along, low, high, scale)
                if place is not None and all(abs(place - kink) > 1e-13 for kink in declared):
                    yield f"the law of {force!r} is not smooth at d = {place:.3g} m; declare the kink in kinks(self)"
                    return


def _kink_between(along: Callable[[float], float], low: float, high: float, scale: float) -> float | None:
    """Return where a slope changes within no distance, between two points; None where the law is smooth."""

    def slopes(low: float, high: float) -> tuple[float, float]:
        h = 0.02 * (high - low)
        return (along(low + h) - along(low)) / h, (along(high) - along(high - h)) / h

    def change(low: float, high: float) -> float:
        first, last = slopes(low, high)
        # a step between the two points shows in no slope at either end, so the chord counts too
        chord = (along(high) - along(low)) / (high - low)
        return max(abs(last - first), abs(chord - first), abs(chord - last))

    before = change(low, high)
    if before * (high - low) < 1e-6 * scale:
        return None  # the change is within rounding, or negligible
    for _ in range(10):
        middle = 0.5 * (low + high)
        low, high = max(((low, middle), (middle, high)), key=lambda half: change(*half))
    # halved ten times, the change of a smooth slope falls by 1000; the change at a kink stays
    return 0.5 * (low + high) if change(low, high) > 0.25 * before else None


def _is_the_slope_of_its_potential(model: type[Force]) -> Iterator[str]:
    if model.potential is None:
        return
    for force in bound_examples(model):
        numbers = force.values()
        for d in np.concatenate([np.linspace(-2e-9, 3e-9, 101), np.geomspace(3e-9, 5e-8, 20)]):
            h = 1e-4 * max(abs(d), 1e-10)
            if any(abs(d - kink) < 4.0 * h for kink in force.kinks()):
                continue
            energy = [model.potential(d + n * h, *numbers) for n in (-2, -1, 1, 2)]
            slope = (energy[0] - 8.0 * energy[1] + 8.0 * energy[2] - energy[3]) / (12.0 * h)
            value = force.law_function()(d, 0.0, 0.0, *_average(force), *numbers)
            # the energies are rounded, and the difference magnifies that
            noise = 1e-14 * max(map(abs, energy)) / h + 1e-30
            if abs(value + slope) > 1e-6 * abs(value) + noise:
                yield f"the law of {force!r} is {value} at d = {d} m and minus the potential's slope {-slope}"
                return


def _keeps_or_takes_energy(model: type[Force]) -> Iterator[str]:
    for force in bound_examples(model):
        if not force.dissipative:
            yield from _depends_on_distance_alone(force)
            continue
        if force.timed:
            continue  # an external modulation of the force may do work on the tip
        contact, omega = INSTRUMENT["contact.a0"], 2.0 * math.pi * 50e3

        def motion(t: float, contact: float = contact, omega: float = omega) -> tuple[float, float]:
            return contact + 2e-9 + 3e-9 * math.cos(omega * t), -3e-9 * omega * math.sin(omega * t)

        times = np.linspace(0.0, 2.0 * 2.0 * math.pi / omega, 401)
        answer = follow(force, motion, times.tolist(), compiled=force.evolve is not None, zc=2e-9)
        turned = np.abs(np.diff(answer.energy)).sum()
        # the second cycle counts: the first starts from a rested sample
        taken = answer.energy[-1] - answer.energy[200]
        if not taken >= -1e-6 * turned:
            yield f"{force!r} adds {-taken} J a cycle to the tip, but a sample can only dissipate energy"


def _depends_on_distance_alone(force: Force) -> Iterator[str]:
    if force.evolve is not None or force.switch is not None:
        yield "a force with memory or a latch dissipates energy: set dissipative = True"
        return
    law, rest = force.law_function(), (*_average(force), *force.values())
    for d in DISTANCES:
        for t in TIMES:
            if len({law(d, rate, t, *rest) for rate in RATES}) > 1:
                yield "the law depends on the rate: set dissipative = True"
                return
        if not force.timed and law(d, 0.0, TIMES[0], *rest) != law(d, 0.0, TIMES[1], *rest):
            yield "the law depends on time: set timed = True"
            return


def _rests_at_zero(model: type[Force]) -> Iterator[str]:
    if model.evolve is None:
        return
    force = bound_examples(model)[0]
    change = np.full(force.memory, math.nan)
    try:
        force.evolve(1e-6, 0.0, 0.0, np.zeros(force.memory), change, *force.values())  # type: ignore[misc]
    except IndexError:
        yield _has_more_states(force)
        return
    written = change[~np.isnan(change)]
    if len(written) < force.memory:
        yield f"'evolve' writes {len(written)} of its memory = {force.memory} states"
    if np.any(written != 0.0):
        yield "a rested sample far from the tip does not stay at rest: evolve must be zero there"


def _has_more_states(force: Force) -> str:
    return f"the law or 'evolve' has more states than memory = {force.memory}"


def _survives_a_file(model: type[Force]) -> Iterator[str]:
    for changes in ({}, *_choices(model)):
        force = model(**{**model.example, **changes})
        written = force.model_dump(mode="json", exclude_none=True)
        for name, value in written.items():
            items = value if isinstance(value, list) else [value]
            if not all(isinstance(item, str | int | float) for item in items):
                yield f"the parameter '{name}' cannot be written to a case file"
        if model(**written) != force:
            yield f"{force!r} changes when written to a case file and read back"
        if eval(repr(force), {model.__name__: model}) != force:
            yield f"{force!r} changes when its printed values are typed in"


CHECKS: tuple[Callable[[type[Force]], Iterator[str]], ...] = (
    _is_declared,
    _uses_only_its_arguments,
    _survives_a_file,
    _is_finite,
    _rests_at_zero,
    _is_smooth_but_for_its_kinks,
    _is_the_slope_of_its_potential,
    _keeps_or_takes_energy,
    _compiles_to_the_same,
)
