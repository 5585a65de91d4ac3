"""`dforce cantilevers`: the cantilevers known by name."""

from __future__ import annotations

from typing import Annotated

import typer

import dforce as df
from dforce.cli._options import Json
from dforce.cli._terminal import DONE, print_json, tell


def cantilevers(
    name: Annotated[str | None, typer.Argument(show_default=False, help="Show this cantilever only.")] = None,
    json: Json = False,
) -> int:
    """List the cantilevers of the library, or show one, with the nominal values of their makers."""
    known = df.cantilevers()
    if name is None:
        if json:
            print_json([vars(probe) for probe in known.values()])
        else:
            tell(known.as_text())
        return DONE
    probe = known.meant(name)
    if json:
        print_json(vars(probe))
        return DONE
    tell(probe.as_text())
    return DONE
