"""`dforce validate`: checks against published values and independent solvers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dforce.cli._options import Json, option
from dforce.cli._terminal import DONE, SOME_POINTS_FAILED, print_json, say
from dforce.core.files import check_target, write_whole


def validate(
    output: Annotated[Path | None, option("-o --output", "PAGE.md", "Write the page to a file.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only the checks that take seconds.")] = False,
    json: Json = False,
) -> int:
    """Check dForce against published values, exact balances and independent integrators.

    Prints a page in Markdown, or writes it. Exit code 1: the page contains a failed check.
    """
    target = None if output is None else check_target(output, (".md",))
    from dforce.checks import validation

    result = validation.validate(quick, say)
    page = validation.validation_page(result)
    if target is not None:
        write_whole(target, page.encode())
        say(f"written: {output}")
    if json:
        print_json(result)
    elif target is None:
        typer.echo(page)
    return DONE if result["met"] else SOME_POINTS_FAILED
