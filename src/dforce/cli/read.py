"""`dforce read`: a measured curve of amplitude and phase, as dForce understands it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import dforce as df
from dforce.cli._names import open_source
from dforce.cli._options import PICTURE, Json, option, repeated
from dforce.cli._outputs import Outputs
from dforce.cli._report import quoted
from dforce.cli._terminal import (
    DONE,
    SOME_POINTS_FAILED,
    console,
    print_json,
    printable,
    say,
    whole_number,
    width,
    wrapped,
)
from dforce.core.errors import shorten
from dforce.core.units import show_range

if TYPE_CHECKING:
    import xarray as xr

MOST_CURVES = 10_000_000
NUMBERS = (
    ("free amplitude", "free_amplitude", "m"),
    ("noise of the amplitude", "amplitude_error", "m"),
    ("noise of the phase", "phase_error", "deg"),
    ("offset of the phase", "phase_offset", "deg"),
    ("height offset, about", "height_offset", "m"),
    ("spring constant k", "k", "N/m"),
    ("resonance frequency f0", "f0", "Hz"),
    ("quality factor Q", "Q", "1"),
)
Pairs = Annotated[
    list[str], repeated("--columns", "NAME=COLUMN", 'Column of a quantity, such as amplitude="Lock-in R"')
]
Calibrated = Annotated[
    str,
    typer.Option(
        "--calibrated", metavar="static|mode", help="Calibration of the sensitivity: by a force curve or for mode 1."
    ),
]


@dataclass(frozen=True)
class FileReading:
    """How the file of a measured curve is read."""

    columns: Pairs
    units: Annotated[
        list[str], repeated("--units", "NAME=UNIT", "Unit of a column without a unit, such as amplitude=nm")
    ]
    phase_convention: Annotated[
        str | None,
        option(
            "--phase --phase-convention",
            "CONVENTION",
            "Phase convention of the file, relative to the lag behind the drive: lag, lag-90, 90-lag or lead.",
        ),
    ] = None
    sensitivity: Annotated[
        str | None, option("--sensitivity", "LENGTH/V", 'Sensitivity that converts volts, such as "52 nm/V".')
    ] = None
    amplitude_is: Annotated[
        str | None, option("--amplitude-is", "peak|rms|peak-to-peak", "Amplitudes in the file; peak is zero to peak.")
    ] = None
    height: Annotated[str | None, option("--height", "sensor|piezo", "Height to use, if the file has both.")] = None
    height_grows: Annotated[
        str | None,
        option("--height-grows", "away|toward", "Direction of larger heights: away from the sample or toward it."),
    ] = None
    direction: Annotated[
        str | None,
        option("--direction", "approach|retract", "Direction of the curve, if the file does not contain it."),
    ] = None
    curve: Annotated[str | None, option("--curve", "NUMBER", "Number of the curve in a file with several, from 1.")] = (
        None
    )


@dataclass(frozen=True)
class LeverSpectrum:
    """A thermal spectrum of the same lever."""

    thermal: Annotated[
        Path | None, option("--thermal", "SPECTRUM", "A file of the thermal spectrum, for f0, Q and k.")
    ] = None
    temperature: Annotated[
        str | None,
        option(
            "--temperature", "TEMPERATURE", 'Temperature of the thermal spectrum, such as "25 degC"; default: 298.15 K.'
        ),
    ] = None
    calibrated: Calibrated = "static"


def read(
    file: Annotated[str, typer.Argument(metavar="FILE", show_default=False, help="A file of a measured curve.")],
    how: FileReading,
    spectrum: LeverSpectrum,
    case: Annotated[
        str | None,
        option(
            "--case",
            "CASE",
            "The case of the instrument, for its free lag, k, f0 and Q, and for the settings of the file in its "
            "table [data].",
        ),
    ] = None,
    output: Annotated[Path | None, option("--output -o", "OUT.nc|OUT.csv", "File for the curve.")] = None,
    plot: Annotated[Path | None, option("--plot", PICTURE, "Draw the curve.")] = None,
    json: Json = False,
) -> int:
    """Read a measured curve, calibrate it, and list the steps.

    Files: HDF5 (.h5, .hdf5), text (.csv, .tsv, .txt, .dat, .asc), Igor binary wave of Asylum Research (.ibw). Also
    Nanosurf .nid, result of dForce (.nc), text of Bruker's NanoScope and text of JPK (.txt). Packages may add others. Some
    need the extra dforce[readers]. If something is missing, dForce asks; it never guesses. Options here replace settings of
    the case. Exit code 1: the curve was read, but not calibrated.
    """
    from dforce.case import Data
    from dforce.inverse.fitting.load import calibration_of, reading_of

    opened = None if case is None else open_source(case, [])
    asked_for = [Path(file), *([] if spectrum.thermal is None else [Path(spectrum.thermal)])]
    outputs = Outputs(plot, output=output, spare=[*asked_for, *(() if opened is None else opened.files)])
    number = None if how.curve is None else whole_number("--curve", how.curve, 1, MOST_CURVES)
    source = None if opened is None else opened.case
    table = Data() if source is None or source.data is None else source.data
    asked = vars(how) | {"curve": number, "columns": None, "units": None}
    settings = reading_of(table) | {name: value for name, value in asked.items() if value is not None}
    for name, typed in (("columns", named("--columns", how.columns)), ("units", named("--units", how.units))):
        settings[name] = {**settings.get(name, {}), **typed}
    tune = _tune(spectrum, how.sensitivity)
    calibration = calibration_of(table) | ({} if tune is None else {"thermal": tune})
    data = df.read_measured(file, **settings)
    missing = ""
    if "neighbor_correlation" not in data.attrs:
        try:
            data = df.calibrate(data, source, **calibration)
        except df.ParameterError as error:
            missing = str(error)
    outputs.keep(data, output)
    outputs.draw(lambda sheet: df.plot.measured(data, sheet))
    files = outputs.written
    if json:
        print_json(_answer(data, file, files, missing))
    else:
        _print(data, file)
        if files:
            typer.echo(f"written: {', '.join(files)}")
        for line in data.attrs["history"]:
            if line.startswith("doubt: "):
                say(line)
    if missing:
        say(f"not calibrated: {missing}")
    return outputs.end(SOME_POINTS_FAILED if missing else DONE)


def named(option: str, given: list[str]) -> dict[str, str]:
    """Return the options typed as NAME=VALUE."""
    found = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise df.ParameterError(f"{option} '{shorten(text)}' is not NAME=VALUE")
        found[name.strip()] = value.strip()
    return found


def _tune(spectrum: LeverSpectrum, sensitivity: str | None) -> df.ThermalTune | None:
    if spectrum.thermal is None:
        if spectrum.temperature is not None:
            raise df.ParameterError("--temperature needs a thermal spectrum; also write --thermal")
        return None
    return df.thermal_tune(
        spectrum.thermal, sensitivity=sensitivity, calibrated=spectrum.calibrated, temperature=spectrum.temperature
    )


def _print(data: xr.Dataset, file: str) -> None:
    """Print a table of the curve, and below it every step."""
    from rich.table import Table
    from rich.text import Text

    table = Table(show_header=False, box=None, pad_edge=False, padding=(0, 3, 0, 0))
    for label, text in _rows(data):
        table.add_row(Text(label), Text(text))
    terminal = console()
    terminal.print(Text(wrapped(printable(f"measured curve {quoted(file)}"), width()), style="bold"))
    terminal.print(table)
    terminal.print()
    for line in data.attrs["history"]:
        terminal.print(Text(wrapped(printable(line), width(), then="    ")))


def _rows(data: xr.Dataset) -> list[tuple[str, str]]:
    from dforce.inverse.values import show as with_error  # its folder loads NumPy

    directions = [word for word in ("approach", "retract") if (data["direction"].values == word).any()]
    heights = show_range(float(data["height"].min()), float(data["height"].max()), "m", 5)
    rows = [
        ("points", f"{data.sizes['point']} ({' and '.join(directions)})"),
        ("heights", f"{heights} ({data.attrs.get('height_kind', '')})"),
    ]
    for label, name, unit in NUMBERS:
        if name in data.attrs:
            rows.append((label, with_error(float(data.attrs[name]), data.attrs.get(f"{name}_error"), unit)))
    return rows


def _answer(data: xr.Dataset, file: str, files: list[str], missing: str) -> dict[str, Any]:
    """Return the JSON: SI numbers, phases in degrees."""
    plain = {key: value for key, value in data.attrs.items() if isinstance(value, int | float | str) and key != "case"}
    return {
        "source": file,
        "files": files,
        "points": data.sizes["point"],
        "calibrated": not missing,
        "missing": missing,
        "attributes": plain,
        "history": list(data.attrs["history"]),
        "columns": {str(name): str(variable.attrs.get("units", "1")) for name, variable in data.data_vars.items()},
    }
