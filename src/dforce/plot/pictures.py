"""Any quantities against any other, of one result or several laid over each other."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from dforce.core.errors import ParameterError, checked, nearest, shorten
from dforce.plot.laid_over import lay_over
from dforce.plot.overview import overview
from dforce.plot.sweeps import cases_of
from dforce.results.curves import Picture, drawable, first_state, goes_along, pictures_of
from dforce.results.dataset import COLUMN_DIMS
from dforce.results.kinds import is_kind, kind_of


@checked
def draw(
    results: xr.Dataset | Mapping[str, xr.Dataset],
    picture: Picture | None = None,
    figure: FigureBase | None = None,
    measured: xr.Dataset | None = None,
) -> list[Axes]:
    """Draw quantities against another quantity, and return all axes.

    Parameters
    ----------
    results
        A result, or several by name; each result or case of a sweep has a color.
    picture
        The picture to draw; left out: the most useful, or the overview of a single result.
    measured
        A curve from :func:`dforce.calibrate`, drawn as gray points in pictures of the measured quantities; its heights count
        as average distances.

    Raises
    ------
    ParameterError
        When no result has these quantities, or they do not go along the same dimension.
    """
    layers = {"": results} if isinstance(results, xr.Dataset) else dict(results)
    first = next(iter(layers.values()), None)
    if first is None:
        raise ParameterError("no result to draw")
    if len(layers) == 1 and ((picture is None and measured is None) or is_kind(first, "basins")):
        return overview(first, figure)
    picture = picture or next(iter(pictures_of(first)), None)
    if picture is None:
        raise ParameterError("a map of basins cannot be drawn over others")
    own = _own(first, picture, measured, figure) if len(layers) == 1 else None
    if own is not None:
        return own
    if len(layers) == 1:
        layers = _cases(first, picture)
    wanted = {picture.x, *picture.y}
    able = {name: result for name, result in layers.items() if wanted <= set(drawable(result, picture.x))}
    if not able:
        raise ParameterError(f"these results lack {' or '.join(sorted(wanted))}, so nothing can be drawn")
    return lay_over(able, picture, figure, measured)


def _cases(result: xr.Dataset, picture: Picture) -> dict[str, xr.Dataset]:
    """Return the cases of a sweep by name, else the result, after a check that it has the quantities of a picture."""
    for name in (picture.x, *picture.y):
        if name not in result.variables:
            known = [str(name) for name, variable in result.variables.items() if variable.dtype.kind == "f"]
            raise ParameterError(
                f"this result has no '{shorten(name)}' to draw{nearest(name, known, 'printing the result')}"
            )
    along = picture.x if picture.x in result.dims else goes_along(result)
    layers = cases_of(first_state(result), along)
    known = drawable(next(iter(layers.values())), picture.x)
    for name in picture.y:
        if name not in known:
            dims = [str(dim) for dim in result[name].dims if dim not in COLUMN_DIMS]
            goes = f"goes along {' and '.join(dims)}" if dims else "is one number"
            raise ParameterError(f"'{name}' is not a curve over '{picture.x}': it {goes}")
    return layers


def _own(
    result: xr.Dataset, picture: Picture, measured: xr.Dataset | None, figure: FigureBase | None
) -> list[Axes] | None:
    """Draw a picture by its kind's own function, with further details; None where the kind has no function for it."""
    kind = kind_of(result)
    if (
        kind is None
        or picture not in pictures_of(result)
        or (result.sizes.get("tone", 1) > 1 and "amplitude" in picture.y)
    ):
        return None
    points = {"measured": measured} if kind.name == "approach" else {}
    return kind.drawn_alone(result, picture.y, figure=figure, **points)
