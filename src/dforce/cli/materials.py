"""`dforce materials`: the samples known by name."""

from __future__ import annotations

from typing import Annotated

import typer

import dforce as df
from dforce.cli._options import Json
from dforce.cli._terminal import DONE, print_json, tell


def materials(
    name: Annotated[str | None, typer.Argument(show_default=False, help="Show this material alone.")] = None,
    json: Json = False,
) -> int:
    """List the samples of the library, or show one: nominal values with their range and source."""
    known = df.materials()
    shown = known if name is None else known.meant(name)
    if json:
        print_json([vars(one) for one in known.values()] if name is None else vars(shown))
    else:
        tell(shown.as_text())
    return DONE
