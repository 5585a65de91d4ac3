"""Advice on a sweep: the advice at the corners of its grid, where most models are at their limits."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

from dforce.maps._one_by_one import unpadded
from dforce.maps._result import SweepLayout
from dforce.validity import Advice, advice, points_not_settled

if TYPE_CHECKING:
    import xarray as xr

MOST_CORNERS = 8


def advice_on_sweep(layout: SweepLayout, data: xr.Dataset | None) -> list[Advice]:
    """Return the advice on the cases at the corners of a grid, each piece once with the corner that it is about.

    Points that did not settle are counted over the whole grid. Without data the advice is about the cases alone.
    """
    whole = None if data is None else points_not_settled(layout.case, data[["status"]])
    found: dict[str, Advice] = {} if whole is None else {whole.name: whole}
    for at in layout.corners(MOST_CORNERS):
        part = None if data is None else _curve(data.isel(at))
        for piece in advice(layout.case_at(at), part):
            found.setdefault(piece.name, dataclasses.replace(piece, text=f"At {layout.where(at)}: {piece.text}"))
    return list(found.values())


def _curve(part: xr.Dataset) -> xr.Dataset:
    """Return the result of one case; a curve goes along its own distances."""
    part = unpadded(part)
    if "zc" in part.coords and part["zc"].dims not in ((), ("zc",)):
        part = part.swap_dims({part["zc"].dims[0]: "zc"})
        part.attrs.pop("along", None)
    return part
