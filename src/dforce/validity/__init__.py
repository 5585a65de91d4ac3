"""Advice: where the chosen model, or a result, is misleading.

Each piece is a function of the evidence, a case and its result where there is one, that gives an :class:`Advice` or nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from dforce.case import Case, case_of
from dforce.core.errors import ParameterError, checked
from dforce.results.kinds import check_shape, swept
from dforce.validity import contact, drive, dynamics, inputs, laws, locks, long_range, noise, sampling, states
from dforce.validity._advice import Advice, Advices, advice_in, attributes
from dforce.validity._evidence import Evidence

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["PIECES", "Advice", "Advices", "Evidence", "advice", "advice_in", "attributes", "points_not_settled"]

PIECES: tuple[Callable[[Evidence], Advice | None], ...] = (
    *inputs.PIECES,
    *laws.PIECES,
    *sampling.PIECES,
    *contact.PIECES,
    *long_range.PIECES,
    *drive.PIECES,
    *locks.PIECES,
    *dynamics.PIECES,
    *states.PIECES,
    *noise.PIECES,
)


# the balances of a steady motion, which under thermal motion hold only on long means
BALANCES = (sampling.sampling, sampling.step_error, sampling.energy_gained)
FORCES_ALONE = (*inputs.PIECES, *laws.PIECES, *contact.PIECES, *long_range.PIECES)  # the advice on a force curve
THERMAL_SPECTRUM = inputs.PIECES  # of a free lever, without drive and sample


@checked
def advice(case: Case | xr.Dataset, result: xr.Dataset | None = None) -> Advices:
    """Return the advice on a case, on a case and its result, or on a result; the list may be empty.

    Without a result, advice on the motion is omitted or uses a bound. A result alone is enough, because it contains its case.
    For a sweep or a plan, which have many cases, the advice in the result is returned (:func:`advice_in`).

    Raises
    ------
    ParameterError
        When a result does not contain its case, or both arguments are results.
    """
    if not isinstance(case, Case):
        if result is not None:
            raise ParameterError("both arguments are results; pass a case and its result, or one result")
        if {"over", "plan_over"} & case.attrs.keys():
            return advice_in(case)
        check_shape(case)
        seen = Evidence(case_of(case), case)
    elif result is not None and (swept(result) or "plan_over" in result.attrs):
        return advice_in(result)
    else:
        seen = Evidence(case, result)
    pieces = FORCES_ALONE if seen.is_force_curve else PIECES
    if seen.case.experiment is not None and seen.case.experiment.kind == "thermal_spectrum":
        pieces = THERMAL_SPECTRUM
    if seen.case.solver.integrator == "langevin":
        pieces = tuple(piece for piece in pieces if piece not in BALANCES)
    return Advices(found for piece in pieces if (found := piece(seen)) is not None)


def points_not_settled(case: Case, result: xr.Dataset) -> Advice | None:
    """Return the advice on the points of any result, a sweep's too, that had not settled."""
    return sampling.not_settled(Evidence(case, result))
