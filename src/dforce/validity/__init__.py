"""Advice: where the chosen model, or a result, stops meaning what it seems to say.

Each piece is a function of the evidence, a case and its result where there is one, that gives an :class:`Advice` or nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from dforce.validity import contact, dynamics, inputs, long_range, sampling, states
from dforce.validity._advice import Advice, advice_in, attributes
from dforce.validity._evidence import Evidence

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case

__all__ = ["PIECES", "Advice", "advice", "advice_in", "attributes", "points_not_settled"]

PIECES: tuple[Callable[[Evidence], Advice | None], ...] = (
    *inputs.PIECES,
    *sampling.PIECES,
    *contact.PIECES,
    *long_range.PIECES,
    *dynamics.PIECES,
    *states.PIECES,
)


FORCES_ALONE = (*inputs.PIECES, *contact.PIECES, *long_range.PIECES)  # what a force curve can be told


def advice(case: Case, result: xr.Dataset | None = None) -> list[Advice]:
    """Return the advice on a case, and on its result where one is given; a calm case gives none.

    Without a result, what depends on the motion is left out, or a bound takes its place.
    """
    seen = Evidence(case, result)
    pieces = FORCES_ALONE if seen.is_force_curve else PIECES
    return [found for piece in pieces if (found := piece(seen)) is not None]


def points_not_settled(case: Case, result: xr.Dataset) -> Advice | None:
    """Return the advice on the points of any result, a sweep's too, that had not settled."""
    return sampling.not_settled(Evidence(case, result))
