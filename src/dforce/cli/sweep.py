"""`dforce sweep`: the cases of a table `[sweep]`, many at once."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import dforce as df
from dforce.cli._names import CaseName, Source, open_source
from dforce.cli._report import advice_lines, as_json, counted, quoted, status_lines
from dforce.cli._terminal import (
    DONE,
    SOME_POINTS_FAILED,
    STOPPED,
    Json,
    Settings,
    Traceback,
    print_json,
    say,
    whole_number,
)
from dforce.core.files import check_target
from dforce.core.progress import ProgressBar
from dforce.core.stopping import late_stop_waits
from dforce.findings.motions import set_point_not_met

if TYPE_CHECKING:
    import xarray as xr

MOST_WORKERS = 100_000


def sweep(
    case: CaseName,
    settings: Settings,
    output: Annotated[
        str,
        typer.Option(
            "--output",
            "-o",
            metavar="OUT.zarr|URL.zarr|OUT.nc",
            show_default=False,
            help="Where the result goes: a store of any size, which grows block by block, or a file, written at the end.",
        ),
    ],
    keep: Annotated[
        str | None,
        typer.Option(
            "--keep",
            metavar="NAMES",
            show_default=False,
            help="Quantities to keep, such as amplitude,phase,peak_force.",
        ),
    ] = None,
    at_set_point: Annotated[
        str | None,
        typer.Option(
            "--at-set-point",
            metavar="SHARE",
            show_default=False,
            help="Keep only the states in which the amplitude is this share of the free amplitude, such as 0.8 or 80%.",
        ),
    ] = None,
    workers: Annotated[
        str | None,
        typer.Option("--workers", metavar="N", show_default=False, help="Threads; left out: one for each core."),
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option(
            "--cluster",
            metavar="tcp://...",
            show_default=False,
            help="Address of the scheduler of a Dask cluster, whose workers compute the blocks of a store.",
        ),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with what is in OUT.")] = False,
    plot: Annotated[
        Path | None,
        typer.Option("--plot", metavar="FIG.png|.pdf|.svg", show_default=False, help="Draw some of the cases."),
    ] = None,
    json: Json = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
    traceback: Traceback = False,
) -> int:
    """Compute all cases of a table [sweep] and write one result.

    Ctrl-C and SIGTERM keep the cases that are done, and a store keeps them whatever happens; --resume goes on.
    """
    source = open_source(case, settings)
    if source.case.sweep is None:
        raise df.ParameterError(
            f"{quoted(case)} does not say what to vary; write [sweep] into it, such as "
            'over = { "sample.youngs_modulus" = ["1 GPa", "2 GPa"] }'
        )
    from dforce.results.store import is_store

    in_blocks = is_store(output)
    if not in_blocks:
        check_target(output)
    if plot is not None:
        check_target(plot, df.plot.FORMATS)
    start = time.monotonic()
    with late_stop_waits() as late:  # until the result is written
        with ProgressBar(source.case.title or source.stem, shown=not quiet) as bar:
            result = df.sweep(
                source.case,
                progress=bar,
                workers=None if workers is None else whole_number("--workers", workers, 1, MOST_WORKERS),
                quantities=None if keep is None else [name.strip() for name in keep.split(",")],
                at_set_point=at_set_point,
                store=output if in_blocks else None,
                client=cluster,
                resume=resume if in_blocks else df.read(output) if resume else None,
            )
        seconds = time.monotonic() - start
        stopped = bool(result.attrs.get("interrupted"))
        counts = counted(result)
        if stopped and not in_blocks and set(counts) == {df.Status.NOT_COMPUTED}:
            say("dforce: stopped before the first case was done; nothing was written")
            return STOPPED
        if not in_blocks:
            df.write(result, output)
    if plot is not None:
        df.plot.save(df.plot.overview(result, df.plot.Sheet()), plot)
    bad = {df.Status.FAILED, df.Status.UNRESOLVED, df.Status.INACCURATE, df.Status.BROKEN}
    failed = bool(bad & set(counts))
    code = STOPPED if stopped or late.asked else SOME_POINTS_FAILED if failed else DONE
    if json:
        print_json(_answer(source, result, output, plot, seconds, code))
    elif not quiet:
        for line in _lines(source, result, "" if resume else f" in {seconds:.3g} s"):
            typer.echo(line)
        typer.echo(f"written: {', '.join(str(path) for path in (output, plot) if path is not None)}")
        for line in [*status_lines(result), *result.attrs.get("notes", "").splitlines()]:
            say(line)
        for line in advice_lines(result, output):
            say(line)
    if stopped:
        share = [] if at_set_point is None else [f"--at-set-point {at_set_point}"]
        again = ["dforce sweep", quoted(case), *(f"--set {quoted(setting)}" for setting in settings)]
        on = f"continue with: {' '.join([*again, '-o', quoted(output), *share, '--resume'])}"
        if share and not in_blocks:
            on = "only a store (-o OUT.zarr) could be continued at a set point"
        say(f"dforce: stopped; what is done is kept; {on}")
    return code


def _lines(source: Source, result: xr.Dataset, took: str) -> list[str]:
    """Return what a sweep gave, in lines for a reader."""
    sizes = ", ".join(f"{name} {size}" for name, size in result.sizes.items())
    points = int(result["status"].size)
    done = points - counted(result).get(df.Status.NOT_COMPUTED, 0)
    share = f"{points}" if done == points else f"{done} of {points}"
    lines = [source.case.title] if source.case.title else []
    if "crossing" in result.dims:
        missing = set_point_not_met(result)
        lines += [f"{missing.label}: {missing.text}"] if missing.value else []
    return [*lines, f"{share} points{took}, over {sizes}"]


def _answer(
    source: Source, result: xr.Dataset, written: str, plot: Path | None, seconds: float, code: int
) -> dict[str, Any]:
    """Return what `--json` prints."""
    return {
        "title": source.case.title,
        "file": written,
        "picture": None if plot is None else str(plot),
        "seconds": round(seconds, 3),
        "exit_code": code,
        "sizes": {str(name): size for name, size in result.sizes.items()},
        **{key: value for key, value in as_json(result).items() if key != "found"},
    }
