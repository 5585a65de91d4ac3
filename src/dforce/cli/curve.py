"""`dforce curve`: the force of a case against distance, without a cantilever."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

import dforce as df
from dforce.cli._names import CaseName, open_source
from dforce.cli._options import PICTURE, Json, Settings, option
from dforce.cli._outputs import Outputs
from dforce.cli._report import advice_lines, as_json, print_findings
from dforce.cli._terminal import DONE, print_json, say, whole_number
from dforce.core.units import show

MOST_POINTS = 1_000_000


@dataclass(frozen=True)
class CurveDistances:
    """Where the force is computed, and how fast the tip passes."""

    start: Annotated[
        str | None, option("--from", "DISTANCE", "Farthest distance; default: at the range of the force.")
    ] = None
    stop: Annotated[str | None, option("--to", "DISTANCE", "Closest distance; default: the depth of a tap.")] = None
    points: Annotated[str, typer.Option("--points", metavar="NUMBER", help="Number of distances.")] = "501"
    speed: Annotated[
        str | None, option("--speed", "VELOCITY", "Speed of the tip, for forces with memory or drag; default: 10 nm/s.")
    ] = None


def curve(
    case: CaseName,
    settings: Settings,
    distances: CurveDistances,
    output: Annotated[Path | None, option("--output -o", "OUT.nc|OUT.csv", "File for the curve.")] = None,
    plot: Annotated[Path | None, option("--plot", PICTURE, "Draw the curve.")] = None,
    json: Json = False,
) -> int:
    """Compute the force against distance, on approach and retract."""
    import numpy as np

    source = open_source(case, settings)
    outputs = Outputs(plot, output=output, spare=source.files)
    far, near = _quantity("--from", distances.start, "m"), _quantity("--to", distances.stop, "m")
    velocity = _quantity("--speed", distances.speed, "m/s")
    count = whole_number("--points", distances.points, 2, MOST_POINTS)
    if far is None or near is None:
        usual = df.force_curve(source.case)["distance"].values
        far = float(usual[0]) if far is None else far
        near = float(usual[-1]) if near is None else near
    if far == near:
        raise df.ParameterError(f"the curve starts and ends at {show(far, 'm')}; write two distances")
    result = df.force_curve(source.case, distance=np.linspace(far, near, count), speed=velocity)
    outputs.keep(result, output)
    outputs.draw(lambda sheet: df.plot.force_curve(result, sheet))
    files = outputs.written
    if json:
        print_json({"title": source.case.title, "files": files, **as_json(result)})
        return outputs.end(DONE)
    print_findings(result)
    if files:
        typer.echo(f"written: {', '.join(files)}")
    for line in advice_lines(result, case):
        say(line)
    return outputs.end(DONE)


def _quantity(option: str, text: str | None, unit: str) -> float | None:
    from dforce.core.parameter_quantity import ParameterQuantity

    try:
        return None if text is None else ParameterQuantity(unit).read(text)
    except df.ParameterError as error:
        raise type(error)(f"{option} {error}") from None
