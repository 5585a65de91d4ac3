"""Interactions of forces: no sum contains one twice, and models are listed by them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from dforce.core.errors import ParameterError
from dforce.forces._contract import REGISTRY, Force


def refuse_double_counting(forces: Sequence[Force]) -> None:
    """Raise :class:`ParameterError` when two forces have the same interaction."""
    for i, second in enumerate(forces):
        for first in forces[:i]:
            common = [interaction for interaction in first.contains if interaction in second.contains]
            if common:
                both = f"{first.name} and {second.name} both contain {' and '.join(common)}"
                if first.name == second.name:
                    both = f"{first.name} appears twice"
                raise ParameterError(f"{both}; {_what_to_remove(first, second, common)}")


def _what_to_remove(first: Force, second: Force, common: list[str]) -> str:
    for whole, part in ((first, second), (second, first)):
        if len(part.contains) == len(common):
            return f"remove {'one of them' if len(whole.contains) == len(common) else part.name}"
    for mixed, other in ((second, first), (first, second)):
        rest = {interaction for interaction in mixed.contains if interaction not in common}
        simpler = next(
            (name for name, model in REGISTRY.items() if model.contains and set(model.contains) == rest), None
        )
        if simpler is not None:
            return f"beside {other.name}, replace {mixed.name} by {simpler}"
    return "remove one of them"


VISCOUS = "Viscous and viscoelastic contact"
LIQUID = "In a liquid, or with a liquid film"
GROUPS = {
    "elastic contact": "Elastic contact, with and without adhesion",
    "contact viscosity": VISCOUS,
    "chemical bond": "Attraction, and bonds",
    "van der Waals": "Attraction, and bonds",
    "double layer": LIQUID,
    "capillary neck": LIQUID,
    "solvation": LIQUID,
    "hydration": LIQUID,
    "electrostatic bias": "Fields",
    "magnetic": "Fields",
}
OWN = "Your own"


def group_of(model: type[Force]) -> str:
    """Return the heading of a model, by its interactions."""
    if model.evolve is not None:
        return VISCOUS
    return next((title for interaction, title in GROUPS.items() if interaction in model.contains), OWN)


def grouped(models: Iterable[type[Force]]) -> dict[str, list[type[Force]]]:
    """Return models under their headings; a heading without a model is left out."""
    given = list(models)
    titles = dict.fromkeys((*GROUPS.values(), OWN))
    found = {title: [model for model in given if group_of(model) == title] for title in titles}
    return {title: members for title, members in found.items() if members}
