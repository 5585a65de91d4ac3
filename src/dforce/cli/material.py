"""`dforce material`: modulus and viscosity by the formulas of AM-FM, beside the true values."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

import dforce as df
from dforce.cli._options import Printed, option
from dforce.cli._outputs import Outputs
from dforce.cli._report import advice_of, as_json, print_findings
from dforce.cli._terminal import DONE, print_json, say


def material(
    *,
    curve: Annotated[
        Path, typer.Argument(metavar="CURVE.nc", show_default=False, help="A result of two tones, AM-FM or FM-FM.")
    ],
    model: Annotated[
        Literal["hertz", "punch", "cone"],
        option("--model", "hertz|punch|cone", "Shape of the tip: paraboloid (default), flat punch or cone."),
    ] = "hertz",
    output: Annotated[
        Path | None, option("--output -o", "OUT.nc|OUT.csv", "File for the values along the curve.")
    ] = None,
    printed: Printed,
) -> int:
    """Compute modulus, indentation and viscosity from AM-FM by the usual formulas, and compare with the true values."""
    outputs = Outputs(output=output, spare=[curve])
    found = df.material(df.read(curve), model)
    outputs.keep(found, output)
    if printed.json:
        print_json(as_json(found))
    elif not printed.quiet:
        print_findings(found)
        for piece in advice_of(found):
            say(f"advice: {piece.text}")
    return outputs.end(DONE)
