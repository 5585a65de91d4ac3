"""`dforce schema`: the JSON schema of case files, for editors."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from dforce.cli._options import option
from dforce.cli._terminal import DONE
from dforce.core.files import check_target, write_whole


def schema(output: Annotated[Path | None, option("--output -o", "FILE.json", "File for the schema.")] = None) -> int:
    """Print the JSON schema of case files, for editors that complete and check them."""
    from dforce.case import case_schema

    text = json.dumps(case_schema(), indent=2, ensure_ascii=output is None)
    if output is None:
        typer.echo(text)
        return DONE
    write_whole(check_target(output, (".json",)), f"{text}\n".encode())
    typer.echo(f"written: {output}")
    return DONE
