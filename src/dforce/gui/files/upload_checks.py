"""Does with a result from outside, once, what a page will do with it: what fails then fails before anything has changed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import dforce as df
from dforce.gui.curves import compare, figures, setpoint
from dforce.gui.curves.basins_figure import basins
from dforce.gui.document.document import LONGEST_NAME, MOST_QUANTITIES
from dforce.gui.measured import fitting, overlay, reconstructed
from dforce.gui.measured.reading import calibrated
from dforce.gui.study import explore, pictures
from dforce.results.curves import Picture, drawable, pictures_of
from dforce.results.kinds import is_kind, kind_of
from dforce.results.measured import by_model

if TYPE_CHECKING:
    import xarray as xr

UNUSABLE = "this result cannot be used here: it differs from results of dForce"


def validate_upload(result: xr.Dataset, folder: Path, chosen: Sequence[Picture] = ()) -> None:
    """Write a result again, and draw and describe all there is in it. Blocking.

    Parameters
    ----------
    result
        What was read.
    folder
        Where it may be written.
    chosen
        Pictures that are going to be drawn of it, beside the usual ones.

    Raises
    ------
    ResultError
        When something of that fails, and for a result that is none of an experiment and no reconstructed force.
    """
    kind = kind_of(result)
    if kind is None or kind.panel != "curves":
        words = "unknown to dForce" if kind is None else f"({kind.words})"
        raise df.ResultError(
            f"the window shows results of experiments, but this is another kind {words}; "
            "df.plot.overview in Python draws it, and so does dforce plot"
        )
    try:
        df.write(result, folder / "again.nc")
        df.write(result.isel({dim: slice(2) for dim in result.dims}), folder / "again.csv")
        names = [str(name) for name in result.variables]
        if len(names) > MOST_QUANTITIES or max(map(len, names)) > LONGEST_NAME:
            raise ValueError("more quantities than an experiment has, or longer names")
        if kind.name == "basins":
            basins(result)
        elif kind.name == "reconstruction":
            reconstructed.figure_of(result)
        else:
            for picture in _pictures(result, chosen):
                states = setpoint.states_of(result, 0.8, picture)
                figures.picture([figures.Layer(result, states=states)], picture)
                if states is not None:
                    setpoint.table_of([figures.Layer(result, states=states)], picture)
            for name in drawable(result):
                figures.picture([figures.Layer(result)], Picture(name, (name,)))
        compare.name_of(result, None, ())
    except OSError as error:  # a full disk says nothing about the file
        if isinstance(error.__cause__, OSError) or not isinstance(error, df.DForceError):
            raise
        raise df.ResultError(UNUSABLE) from error
    except Exception as error:  # whatever the file holds: it must not come as far as the page
        raise df.ResultError(UNUSABLE) from error


def validate_study(result: xr.Dataset) -> None:
    """Draw each quantity of a result over parameters. Blocking.

    Raises
    ------
    ResultError
        When something of that fails.
    """
    try:
        names = explore.quantities(result)
        if not 0 < len(names) <= MOST_QUANTITIES or max(len(str(name)) for name in result.variables) > LONGEST_NAME:
            raise ValueError("no quantities, more than an experiment has, or longer names")
        for name in names:
            choice = explore.fitting(result, explore.Choice(name))
            pictures.figure(result, choice)
            for dim in choice.places:
                explore.label_of(result, dim), explore.places_of(result, dim)
            explore.settings_at(result, explore.picked(result, choice, 0.0, 0.0))
            explore.gaps_of(result, name)
    except Exception as error:  # whatever the file holds: it must not come as far as the page
        raise df.ResultError(UNUSABLE) from error


def validate_measured(result: xr.Dataset) -> None:
    """Calibrate and describe a measured curve, or describe a fit of one. Blocking.

    Raises
    ------
    ResultError
        When it is neither, or something of that fails.
    """
    if not is_kind(result, "measured", "fit"):
        raise df.ResultError("this is neither a measured curve nor its fit")
    try:
        if is_kind(result, "measured"):
            by_model(calibrated(result, {}, None))
        else:
            df.fit_report(result)
            for name in ("amplitude", "phase"):
                overlay.along(result, result[f"{name}_fit"].values[:, 0])
            for name in map(str, result["parameter"].values):
                fitting.found(result, name), fitting.note(result, name)
    except df.ParameterError:  # the settings that are kept beside it say what the curve does not
        return
    except Exception as error:  # whatever the file holds: it must not come as far as the page
        raise df.ResultError(UNUSABLE) from error


def _pictures(result: xr.Dataset, chosen: Sequence[Picture]) -> Iterator[Picture]:
    """Give the usual pictures of a result, and those chosen that it has the quantities for."""
    yield from pictures_of(result)
    known = set(drawable(result))
    yield from (picture for picture in chosen if {picture.x, *picture.y} <= known)
