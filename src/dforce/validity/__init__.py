"""Advice: where the chosen model, or a result, stops meaning what it seems to say.

Each piece is a function of the case, and of its result where there is one, that gives an :class:`Advice` or nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from dforce.validity import contact, results
from dforce.validity._advice import Advice

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case

__all__ = ["PIECES", "Advice", "advice"]

PIECES: tuple[Callable[[Case, xr.Dataset | None], Advice | None], ...] = (
    contact.hamaker_and_surface_energy,
    results.not_settled,
)


def advice(case: Case, result: xr.Dataset | None = None) -> list[Advice]:
    """Return the advice on a case, and on its result where one is given.

    A calm case gives none.
    """
    return [found for piece in PIECES if (found := piece(case, result)) is not None]
