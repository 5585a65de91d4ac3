"""`dforce run`: from a case to a result, a picture and a table of what was found."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import dforce as df
from dforce.cli._names import CaseName, Source, open_source
from dforce.cli._report import advice_lines, as_json, print_findings, quoted, status_lines
from dforce.cli._terminal import DONE, SOME_POINTS_FAILED, STOPPED, Json, Settings, Traceback, print_json, say

if TYPE_CHECKING:
    import xarray as xr


def run(
    case: CaseName,
    settings: Settings,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="OUT.nc|OUT.csv",
            show_default=False,
            help="Where the result goes; an older file is replaced. Left out: NAME.nc, and no file is.",
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option("--plot", metavar="FIG.png|.pdf|.svg", show_default=False, help="Draw the result."),
    ] = None,
    width: Annotated[
        str | None,
        typer.Option("--width", metavar="WIDTH", show_default=False, help='Width of the picture, such as "85 mm".'),
    ] = None,
    json: Json = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
    traceback: Traceback = False,
) -> int:
    """Run a case and write its result.

    CASE may be a result: a complete one is computed again, an interrupted one is continued.
    Ctrl-C keeps the points that are done.
    """  # fmt: skip
    source = open_source(case, settings)
    continued = source.result is not None and bool(source.result.attrs.get("interrupted"))
    over = "" if source.result is None else source.result.attrs.get("over", "")
    if over:
        first, *_ = over.split()
        how = "df.sweep(..., resume=...) continues" if continued else "df.sweep repeats"
        raise df.ResultError(
            f"{quoted(case)} is a sweep over {over.replace(' ', ', ')}, which {how} in Python; "
            f"to run one case of it, give the value: --set {first}=..."
        )
    if output is None and continued:
        output = source.path
    df.check_target(output or _free_name(source.stem))
    if plot is not None:
        df.check_target(plot, df.plot.FORMATS)
    if width is not None:
        if plot is None:
            raise df.ParameterError("--width is that of a picture, and none is drawn; give --plot as well")
        df.plot.check_width(width)
    start = time.monotonic()
    with df.ProgressBar(source.case.title or source.stem, shown=not quiet) as bar:
        result = df.run(source.case, progress=bar, resume=source.result if continued else None)
    seconds = time.monotonic() - start
    stopped = bool(result.attrs.get("interrupted"))
    if stopped and not _computed(result):
        say("dforce: stopped before the first point was done; nothing was written")
        return STOPPED
    written = df.write(result, output) if output is not None else _write_beside(result, source.stem)
    if plot is not None:
        df.plot.save(df.plot.overview(result), plot, width=width)
    code = STOPPED if stopped else SOME_POINTS_FAILED if _failed(result) else DONE
    if json:
        print_json(_answer(source, result, written, plot, seconds, code))
    elif not quiet:
        print_findings(result)
        typer.echo(f"written: {', '.join(str(path) for path in (written, plot) if path is not None)}")
    if not (json or quiet):
        for line in [*status_lines(result), *advice_lines(result, str(written) if written.suffix == ".nc" else case)]:
            say(line)
    if stopped:
        computed, points = _computed(result), _points(result)
        # how many states there are is known when all are found
        done = f"{computed} points" if computed == points else f"{computed} of {points} points"
        say(f"dforce: stopped; {done} are done and kept{_how(written)}")
    return code


def _free_name(stem: str) -> Path:
    """Return NAME.nc, or NAME-2.nc and so on where that is taken."""
    number, path = 1, Path(f"{stem}.nc")
    while path.exists():
        number += 1
        path = Path(f"{stem}-{number}.nc")
    return path


def _write_beside(result: xr.Dataset, stem: str) -> Path:
    """Write to a free name; another process that takes the name in the same moment keeps it."""
    while True:
        try:
            return df.write(result, _free_name(stem), overwrite=False)
        except FileExistsError:
            continue


def _points(result: xr.Dataset) -> int:
    return sum(df.count_status(result).values())


def _computed(result: xr.Dataset) -> int:
    return _points(result) - df.count_status(result).get(df.Status.NOT_COMPUTED, 0)


def _failed(result: xr.Dataset) -> bool:
    return df.Status.FAILED in df.count_status(result)


def _how(written: Path) -> str:
    """Say how to go on with an interrupted run."""
    return (
        f"; continue with: dforce run {quoted(str(written))}"
        if written.suffix == ".nc"
        else "; only a .nc file can be continued"
    )


def _answer(
    source: Source, result: xr.Dataset, written: Path, plot: Path | None, seconds: float, code: int
) -> dict[str, Any]:
    """Return what `--json` prints."""
    return {
        "title": source.case.title,
        "kind": source.case.experiment.kind if source.case.experiment is not None else "",
        "file": str(written),
        "picture": None if plot is None else str(plot),
        "seconds": round(seconds, 3),
        "exit_code": code,
        **as_json(result),
    }
