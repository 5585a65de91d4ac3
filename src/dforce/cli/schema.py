"""`dforce schema`: the JSON schema of case files, for editors."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

import dforce as df
from dforce.cli._terminal import DONE, Traceback


def schema(
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE.json", show_default=False, help="Where the schema goes."),
    ] = None,
    traceback: Traceback = False,
) -> int:
    """Print the JSON schema of case files, which editors use to complete and check them."""
    text = json.dumps(df.case_schema(), indent=2, ensure_ascii=output is None)
    if output is None:
        typer.echo(text)
        return DONE
    df.write_whole(df.check_target(output, (".json",)), f"{text}\n".encode())
    typer.echo(f"written: {output}")
    return DONE
