"""The program `dforce`: its commands and their common options."""

from __future__ import annotations

from typing import Annotated

import typer

import dforce as df
from dforce.cli import (
    _help,
    _terminal,
    benchmark,
    cache,
    cantilevers,
    check,
    curve,
    examples,
    fit,
    gui,
    material,
    materials,
    models,
    plan,
    plot,
    read,
    reconstruct,
    run,
    schema,
    sweep,
    thermal,
    validate,
    warm,
)

HELP = """Plan and explain tapping-mode (AM-AFM) and bimodal AFM experiments.

A first run: dforce run figure-3-air --plot figure-3.png

Exit codes: 0 done, 1 some points have no result, 2 bad input, 3 an error in dForce, 130 stopped by Ctrl-C, SIGTERM or SIGHUP.
"""

app = typer.Typer(
    name="dforce",
    help=HELP,
    cls=_help.Program,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"dForce {df.__version__}")
        raise typer.Exit


@app.callback()
def options(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Read the options before a command; without a command, show the list of commands."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


options.__doc__ = HELP
COMMANDS = (
    run.run,
    sweep.sweep,
    plan.plan,
    check.check,
    curve.curve,
    plot.plot,
    read.read,
    thermal.thermal,
    fit.fit,
    reconstruct.reconstruct,
    material.material,
    models.models,
    examples.examples,
    schema.schema,
    benchmark.benchmark,
    gui.gui,
    validate.validate,
    warm.warm,
    cache.cache,
    cantilevers.cantilevers,
    materials.materials,
)
for _command in COMMANDS:
    app.command(cls=_help.Command)(_terminal.guarded(_command))
