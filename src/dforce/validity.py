"""Advice: where the chosen model, or a result, stops meaning what it seems to say.

Each piece is a function of the case, and of its result where there is one, that gives an :class:`Advice` or nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dforce.case import Case

if TYPE_CHECKING:
    import xarray as xr

SAME_ADHESION = 0.01  # relative difference of two adhesions that is rounding of a printed value, not a choice


@dataclass(frozen=True)
class Advice:
    """A warning with its figures.

    Attributes
    ----------
    name
        Short name, the same in all languages and places.
    found, limit
        The figure found, and the one it should keep to.
    text
        One sentence: what was found, why it matters, what to do.
    source
        Where the limit comes from.
    """

    name: str
    found: float
    limit: float
    text: str
    source: str


def advice(case: Case, result: xr.Dataset | None = None) -> list[Advice]:
    """Return the advice on a case, and on its result where one is given.

    A calm case gives none.
    """
    return [piece for check in CHECKS if (piece := check(case, result)) is not None]


def hamaker_and_surface_energy(case: Case, result: xr.Dataset | None) -> Advice | None:
    """Compare the adhesion in contact with the attraction at contact, where a force was given both."""
    for force in case.problem.forces:
        hamaker, energy = getattr(force, "hamaker", None), getattr(force, "surface_energy", None)
        if force.name != "dmt" or hamaker is None or energy is None:
            continue
        implied = hamaker / (24.0 * math.pi * case.contact.a0**2)
        if abs(energy - implied) > SAME_ADHESION * abs(implied):
            return Advice(
                "hamaker_and_surface_energy",
                energy,
                implied,
                f"dmt is given a surface energy of {1e3 * energy:.3g} mJ/m² and a Hamaker constant that implies "
                f"{1e3 * implied:.3g} mJ/m², so its force jumps at contact; give one of them, and the other follows.",
                "continuity of the DMT force at a0: gamma = H / (24 pi a0^2)",
            )
    return None


def not_settled(case: Case, result: xr.Dataset | None) -> Advice | None:
    """Count the points whose motion was still moving when the largest number of periods was reached."""
    from dforce.results import Status

    if result is None or "status" not in result:
        return None
    moving = int((result["status"] == Status.NOT_SETTLED).sum())
    if moving == 0:
        return None
    return Advice(
        "not_settled",
        moving,
        0,
        f"{moving} of {result['status'].size} points had not settled when the largest number of periods was reached, "
        "so their values still depend on the start; raise solver.max_periods, or look at one of them with a dwell.",
        "solver.settle_tolerance",
    )


CHECKS: tuple[Callable[[Case, xr.Dataset | None], Advice | None], ...] = (hamaker_and_surface_energy, not_settled)
