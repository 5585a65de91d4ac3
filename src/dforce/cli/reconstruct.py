"""`dforce reconstruct`: the force behind a curve, without a model of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import dforce as df
from dforce.cli._names import open_source
from dforce.cli._options import PICTURE, Printed, option
from dforce.cli._outputs import Outputs
from dforce.cli._terminal import DONE, SOME_POINTS_FAILED, print_json, say, tell
from dforce.core.errors import shorten
from dforce.core.progress import ProgressBar
from dforce.core.units import show, show_range

if TYPE_CHECKING:
    import xarray as xr

MEANINGS = ("determined", "blind", "uncertain")


@dataclass(frozen=True)
class PointErrors:
    """Standard deviations of a point."""

    amplitude_error: Annotated[
        str | None, option("--amplitude-error", "LENGTH", 'Standard deviation, such as "20 pm".')
    ] = None
    phase_error: Annotated[str | None, option("--phase-error", "ANGLE", 'Standard deviation, such as "0.2 deg".')] = (
        None
    )


def reconstruct(
    *,
    curve: Annotated[
        Path,
        typer.Argument(
            metavar="CURVE",
            show_default=False,
            help="A result (.nc) of an approach or of branches, or a measured curve; --case has the settings of other files.",
        ),
    ],
    case: Annotated[
        Path | None, option("--case", "CASE.toml", "The case of the instrument, for a measured curve without it.")
    ] = None,
    direction: Annotated[
        str | None, option("--direction", "approach|retract", "Only this direction; default: all points.")
    ] = None,
    errors: PointErrors,
    output: Annotated[Path | None, option("--output -o", "OUT.nc|OUT.csv", "File for the force.")] = None,
    plot: Annotated[Path | None, option("--plot", PICTURE, "Draw the force.")] = None,
    formulas: Annotated[bool, typer.Option("--formulas", help="Also draw the force by published formulas.")] = False,
    printed: Printed,
) -> int:
    """Reconstruct the force against distance from a curve, with its errors and gaps."""
    if formulas and plot is None:
        raise df.ParameterError("--formulas needs a picture; also write --plot")
    source = None if case is None else open_source(str(case), [])
    outputs = Outputs(plot, output=output, spare=[curve, *(() if source is None else source.files)])
    instrument = None if source is None else source.case
    data = _read(curve, instrument)
    if direction is not None:
        data = _walk(data, direction)
    with ProgressBar(str(data.attrs.get("title", "")) or curve.stem, shown=not printed.quiet) as bar:
        found = df.reconstruct(data, instrument, errors.amplitude_error, errors.phase_error, progress=bar)
    outputs.keep(found, output)
    outputs.draw(lambda sheet: df.plot.reconstruction(found, sheet, formulas=formulas))
    files = outputs.written
    notes = [line for line in str(found.attrs["notes"]).splitlines() if line]
    code = DONE if (found["force_status"].values == 0).any() else SOME_POINTS_FAILED  # a gap goes with any jump
    if printed.json:
        print_json({**_found(found), "notes": notes, "files": files, "exit_code": outputs.code(code)})
    elif not printed.quiet:
        for line in _lines(found):
            tell(line)
        if files:
            typer.echo(f"written: {', '.join(files)}")
        for line in notes:
            say(line)
    return outputs.end(code)


def _read(curve: Path, instrument: df.Case | None) -> xr.Dataset:
    """Return a result, or a measured curve, read and calibrated by the table `[data]` of the instrument's case."""
    if curve.suffix == ".nc":
        return df.read(curve)
    if instrument is None:
        raise df.ParameterError(
            f"'{shorten(curve.name)}' is not a result: write --case with the case of the instrument and its table [data]. "
            "Or first type dforce read with -o curve.nc"
        )
    from dforce.inverse.fitting.load import measured_curve

    return measured_curve(instrument, curve)


def _walk(data: xr.Dataset, direction: str) -> xr.Dataset:
    """Return one direction of a curve."""
    if "direction" not in data.variables:
        raise df.ParameterError("this curve has no directions; remove --direction")
    known = sorted({str(name) for name in data["direction"].values.ravel()})
    if direction not in known:
        raise df.ParameterError(f"--direction {shorten(direction)} is not one of {', '.join(known)}")
    if "direction" in data.dims:
        return data.sel(direction=direction)
    return data.isel(point=(data["direction"] == direction).values)


def _found(found: xr.Dataset) -> dict[str, Any]:
    """Return the main numbers in SI, for a program."""
    status = found["force_status"].values
    told = found["force"].where(found["force_status"] == 0)  # behind a gap, and by noise, a force may be anything
    force = told if bool(told.notnull().any()) else found["force"]
    lowest = int(force.fillna(float("inf")).argmin("distance"))
    return {
        "points": found.sizes["point"],
        "from": float(found["distance"].min()),
        "to": float(found["distance"].max()),
        "lowest_force": float(found["force"][lowest]),
        "lowest_force_error": float(found["force_error"][lowest]),
        "at": float(found["distance"][lowest]),
        "largest_sample_energy": float(found["sample_energy"].max()),
        "chi2": float(found.attrs["chi2"]),
        "distances": {name: int((status == number).sum()) for number, name in enumerate(MEANINGS)},
        "gaps": [[float(low), float(high)] for low, high in zip(found["gap_low"], found["gap_high"], strict=True)],
    }


def _lines(found: xr.Dataset) -> list[str]:
    """Return the same for a reader."""
    first = _found(found)
    title = str(found.attrs.get("title", ""))
    counts = ", ".join(f"{count} {name}" for name, count in first["distances"].items() if count)
    return [
        *([title] if title else []),
        f"force from {show_range(first['from'], first['to'], 'm', 4)}, by {first['points']} points",
        f"lowest force: {show(first['lowest_force'], 'N', 3)} ± {show(first['lowest_force_error'], 'N', 2)} "
        f"at {show(first['at'], 'm', 3)}",
        f"chi2: {first['chi2']:.1f} for {first['points']} points",
        f"distances: {counts}",
    ]
