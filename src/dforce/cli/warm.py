"""`dforce warm`: compiles ahead, for a class, an image of a cluster, or a computer that is soon offline."""

from __future__ import annotations

import time
from typing import Annotated

import typer

import dforce as df
from dforce.cli._names import complete_cases
from dforce.cli._terminal import BAD_INPUT, DONE, say
from dforce.core.progress import duration


def warm(
    cases: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="CASE...",
            autocompletion=complete_cases,
            show_default=False,
            help="Case files (.toml), results, or names of examples; default: all examples.",
        ),
    ] = None,
) -> int:
    """Run cases once to compile their code ahead: later runs start at once. Exits with 2 where the code cannot be kept."""
    from dforce.results.status import whole  # loads NumPy, which help does without

    known = {name: df.load_case(name) for name in cases or df.examples()}  # a wrong name is an error before any run
    begun, lost = time.monotonic(), df.kernel_cache().lost
    for count, (name, case) in enumerate(known.items(), 1):
        start = time.monotonic()
        whole(df.run(case))
        if df.kernel_cache().lost > lost:
            say(f"{name}: not ready, because its compiled code was not kept")
            return BAD_INPUT
        now = time.monotonic()
        left = (now - begun) / count * (len(known) - count)
        rest = f", about {duration(left)} left" if count < len(known) else ""
        say(f"{name}: ready after {duration(now - start)} ({count} of {len(known)}{rest})")
    kept = df.kernel_cache()
    typer.echo(f"{kept.folder}\n{kept.kernels} kernels, {kept.size / 1e6:.1f} MB")
    return DONE
