"""`dforce thermal`: f0, Q and k of a lever from the spectrum of its thermal motion."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import dforce as df
from dforce.cli._options import PICTURE, Json, option
from dforce.cli._outputs import Outputs
from dforce.cli._report import quoted
from dforce.cli._terminal import DONE, console, print_json, printable, say, width, wrapped
from dforce.cli.read import Calibrated, Pairs, named
from dforce.core.units import show

if TYPE_CHECKING:
    from dforce.inverse.thermal import ThermalTune

ROWS = {
    "f0": ("resonance frequency f0", "Hz"),
    "Q": ("quality factor Q", "1"),
    "k": ("spring constant k of mode 1", "N/m"),
}
DIGITS = 5  # of the values that a case takes


@dataclass(frozen=True)
class SpectrumCalibration:
    """Effects that the spectrum does not show."""

    sensitivity: Annotated[
        str | None,
        option(
            "--sensitivity",
            "LENGTH/V",
            'Sensitivity that converts volts, such as "52 nm/V" or, with its error, "52(1) nm/V".',
        ),
    ] = None
    calibrated: Calibrated = "static"
    temperature: Annotated[
        str | None, option("--temperature", "TEMPERATURE", 'Temperature, such as "25 degC"; default: 298.15 K.')
    ] = None


def thermal(
    *,
    spectrum: Annotated[
        str,
        typer.Argument(metavar="SPECTRUM", show_default=False, help="A file with frequencies and spectral densities."),
    ],
    columns: Pairs,
    unit: Annotated[
        str | None, option("--unit", "UNIT", 'Unit of the density, if its column has none, such as "pm/sqrt(Hz)".')
    ] = None,
    calibration: SpectrumCalibration,
    band: Annotated[
        str | None,
        option(
            "--band",
            "LOWEST,HIGHEST",
            'Frequencies of the fit, such as "60 kHz,80 kHz"; default: 5 widths of the peak on both sides.',
        ),
    ] = None,
    plot: Annotated[Path | None, option("--plot", PICTURE, "Draw the spectrum and its fit.")] = None,
    json: Json = False,
) -> int:
    """Find f0, Q and k of a lever, with errors, by a fit of its thermal spectrum.

    The spectrum is a text file with two columns, or any file that dForce reads. Copy the last line of
    the output into your case.
    """
    outputs = Outputs(plot, spare=[Path(spectrum)])
    tune = df.thermal_tune(
        spectrum,
        columns=named("--columns", columns),
        unit=unit,
        sensitivity=calibration.sensitivity,
        calibrated=calibration.calibrated,
        temperature=calibration.temperature,
        band=None if band is None else [end.strip() for end in band.split(",")],
    )
    outputs.draw(lambda sheet: df.plot.thermal_spectrum(tune.dataset(), sheet))
    if json:
        print_json(_answer(tune, outputs.picture))
        return outputs.end(DONE)
    _print(tune, spectrum)
    if outputs.picture is not None:
        typer.echo(f"written: {outputs.picture}")
    for line in tune.history:
        if line.startswith("doubt: "):
            say(line)
    return outputs.end(DONE)


def _case(tune: ThermalTune) -> str:
    """Return the lever as a case takes it."""
    f0, k = (show(value, unit, DIGITS) for value, unit in ((tune.f0, "Hz"), (tune.k, "N/m")))
    return f'cantilever = {{ f0 = "{f0}", k = "{k}", Q = {tune.Q:.4g} }}'


def _print(tune: ThermalTune, spectrum: str) -> None:
    """Print the lever in a table, and below it every step."""
    from rich.table import Table
    from rich.text import Text

    from dforce.inverse.values import show as with_error  # its folder loads NumPy

    table = Table(show_header=False, box=None, pad_edge=False, padding=(0, 3, 0, 0))
    values = tune.as_table()
    for name, (label, unit) in ROWS.items():
        table.add_row(Text(label), Text(with_error(*values[name], unit)))
    table.add_row(Text("static spring constant"), Text(show(tune.k_static, "N/m", 4)))
    terminal = console()
    terminal.print(Text(wrapped(printable(f"thermal spectrum {quoted(spectrum)}"), width()), style="bold"))
    terminal.print(table)
    terminal.print()
    for line in (line for line in tune.history if not line.startswith(("f0: ", "Q: "))):
        terminal.print(Text(wrapped(printable(line), width(), then="    ")))
    terminal.print()
    terminal.print(Text(_case(tune)))


def _answer(tune: ThermalTune, plot: Path | None) -> dict[str, Any]:
    """Return the JSON: SI numbers."""
    numbers = {name: value for name, value in vars(tune).items() if isinstance(value, float)}
    return {**numbers, "band": tune.band, "history": tune.history, "case": _case(tune), "picture": plot and str(plot)}
