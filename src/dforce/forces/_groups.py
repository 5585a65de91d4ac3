"""The headings of force models in every list."""

from __future__ import annotations

from collections.abc import Iterable

from dforce.forces._contract import Force

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
