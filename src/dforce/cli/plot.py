"""`dforce plot`: a kept result drawn anew."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Annotated, Any

import typer

import dforce as df
from dforce.cli._names import complete_cases
from dforce.cli._options import PICTURE, option
from dforce.cli._report import quoted
from dforce.cli._terminal import DONE
from dforce.core.files import check_target, exists


def plot(
    result: Annotated[
        str,
        typer.Argument(
            metavar="RESULT",
            autocompletion=complete_cases,
            show_default=False,
            help="A result (.nc, .zarr) of a run, a sweep, a fit, a plan, a map, or a measured curve.",
        ),
    ],
    output: Annotated[
        Path | None,
        option(
            "--output -o",
            PICTURE,
            "File for the picture; replaces an older file. Default: NAME.png, or NAME-2.png beside another file.",
        ),
    ] = None,
    quantity: Annotated[
        str | None,
        option(
            "--quantity", "NAMES", "Quantities to draw, such as peak_force or amplitude,phase. Default: an overview."
        ),
    ] = None,
    over: Annotated[
        str | None,
        option(
            "--over",
            "NAMES",
            "Quantity on the horizontal axis, such as amplitude_ratio. Two of a sweep, such as A0,youngs_modulus, draw a map.",
        ),
    ] = None,
    width: Annotated[str | None, option("--width", "WIDTH", 'Width of the picture, such as "85 mm".')] = None,
) -> int:
    """Draw a saved result: an overview, or chosen quantities."""
    if Path(result).suffix.lower() == ".toml" or (not exists(Path(result)) and result in df.examples()):
        raise df.ParameterError(
            f"{quoted(result)} is a case without a result; first type dforce run {quoted(result)} --plot FIG.png"
        )
    if output is not None:
        check_target(output, df.plot.FORMATS)
    if width is not None:
        df.plot.check_width(width)
    from dforce.plot.sweeps import usual_along  # matplotlib is slow to load
    from dforce.results.curves import Picture

    data, figure = df.read(result), df.plot.Sheet()
    names, across = _split(quantity), _split(over)
    if across and not names:
        raise df.ParameterError(f"--over {over} sets the axis; name the quantity with --quantity")
    if len(across) > 2 or (len(across) == 2 and len(names) > 1):
        raise df.ParameterError("a map draws one --quantity over two parameters, a curve any number over one")
    axes: Any
    if len(across) == 2:
        axes = df.plot.map(data, across[0], across[1], names[0], figure=figure)
    elif names:
        axes = df.plot.draw(data, Picture(across[0] if across else usual_along(data), tuple(names)), figure)
    else:
        axes = df.plot.overview(data, figure)
    path = output or _free(Path(result).stem)
    df.plot.save(axes, path, width=width)
    typer.echo(f"written: {path}")
    return DONE


def _split(names: str | None) -> list[str]:
    return [] if names is None else [name.strip() for name in names.split(",") if name.strip()]


def _free(stem: str) -> Path:
    """Return a name for a picture that no file has."""
    names = (Path(f"{stem}.png" if number == 1 else f"{stem}-{number}.png") for number in itertools.count(1))
    return next(path for path in names if not path.exists())
