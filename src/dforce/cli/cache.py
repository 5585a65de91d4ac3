"""`dforce cache`: where compiled force models lie, and how large that is."""

from __future__ import annotations

from typing import Annotated

import typer

import dforce as df
from dforce.cli._options import Json
from dforce.cli._terminal import DONE, print_json


def cache(
    clear: Annotated[bool, typer.Option("--clear", help="Remove them; each is compiled again when needed.")] = False,
    json: Json = False,
) -> int:
    """Show the folder and size of compiled force models on disk, or remove them."""
    found = df.clear_kernel_cache() if clear else df.kernel_cache()
    if json:
        print_json({"folder": str(found.folder), "kernels": found.kernels, "bytes": found.size, "removed": clear})
        return DONE
    size = f"{found.kernels} kernel{'s' * (found.kernels != 1)}, {found.size / 1e6:.1f} MB"
    typer.echo(f"removed: {size}" if clear else f"{found.folder}\n{size}")
    return DONE
