"""The program `dforce`: its commands and what holds for all of them."""

from __future__ import annotations

from typing import Annotated

import typer

from dforce.cli import _terminal, benchmark, check, curve, examples, gui, models, run, schema, validate

HELP = """Plan and explain tapping-mode (AM-AFM) and bimodal AFM experiments.

A first run: dforce run figure-3-air --plot figure-3.png

Exit codes: 0 done, 1 some points have no result, 2 bad input, 3 an error in dForce, 130 stopped by Ctrl-C.
"""

app = typer.Typer(
    name="dforce",
    help=HELP,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        import dforce as df

        typer.echo(f"dForce {df.__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Take the options that stand before a command."""


options.__doc__ = HELP
COMMANDS = (
    run.run, check.check, curve.curve, models.models, examples.examples, schema.schema, benchmark.benchmark, gui.gui,
    validate.validate,
)  # fmt: skip
for _command in COMMANDS:
    app.command()(_terminal.guarded(_command))


def main() -> None:
    """Run the program; the entry point of the console script."""
    _terminal.never_fail_to_print()
    app()
