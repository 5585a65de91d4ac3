"""Where the numbers of a result do not mean what they seem to say."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dforce.validity._advice import Advice

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case


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
        ("solver.max_periods", "solver.settle_tolerance"),
    )
