"""`dforce sweep`: the cases of a table `[sweep]`, many at once."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import dforce as df
from dforce.cli._names import CaseName, Source, open_source
from dforce.cli._options import PICTURE, Printed, Settings, option
from dforce.cli._outputs import Outputs
from dforce.cli._report import advice_lines, as_json, counted, quoted, status_lines
from dforce.cli._terminal import DONE, SOME_POINTS_FAILED, STOPPED, print_json, say, tell, whole_number
from dforce.core.progress import ProgressBar
from dforce.core.quantities import NONE
from dforce.core.stopping import late_stop_waits

if TYPE_CHECKING:
    import xarray as xr

MOST_WORKERS = 100_000
MOST_LINES = 12  # of states at a set point


@dataclass(frozen=True)
class SweepWorkers:
    """Who computes the cases."""

    workers: Annotated[str | None, option("--workers", "N", "Number of threads; default: one for each core.")] = None
    cluster: Annotated[
        str | None,
        option(
            "--cluster",
            "tcp://...",
            "Address of the scheduler of a Dask cluster; its workers compute the blocks of a store.",
        ),
    ] = None


@dataclass(frozen=True)
class QuantityOptions:
    """Which quantities stay."""

    keep: Annotated[
        str | None, option("--keep", "NAMES", "Quantities to keep, such as amplitude,phase,peak_force.")
    ] = None
    at_set_point: Annotated[
        str | None, option("--at-set-point", "SHARE", "Keep only the states at this A/A0, such as 0.8 or 80%.")
    ] = None


def sweep(
    *,
    case: CaseName,
    settings: Settings,
    output: Annotated[
        str,
        option(
            "--output -o",
            "OUT.zarr|URL.zarr|OUT.nc",
            "A store of any size, written block by block, or a file, written at the end.",
        ),
    ],
    kept: QuantityOptions,
    by: SweepWorkers,
    resume: Annotated[bool, typer.Option("--resume", help="Continue the sweep in OUT.")] = False,
    plot: Annotated[Path | None, option("--plot", PICTURE, "Draw some of the cases.")] = None,
    printed: Printed,
) -> int:
    """Compute all cases of a table [sweep] and write one result.

    Ctrl-C and SIGTERM keep the finished cases. A store also keeps them after a crash; --resume continues.
    """
    source = open_source(case, settings)
    if source.case.sweep is None:
        raise df.ParameterError(
            f"{quoted(case)} has no table [sweep]; add it, such as "
            'over = { "sample.youngs_modulus" = ["1 GPa", "2 GPa"] }'
        )
    from dforce.results.store import is_store

    in_blocks = is_store(output)
    outputs = Outputs(plot, output=None if in_blocks else Path(output), spare=source.inputs)
    start = time.monotonic()
    with late_stop_waits() as late:  # until the result is written
        with ProgressBar(source.case.title or source.stem, shown=not printed.quiet) as bar:
            result = df.sweep(
                source.case,
                progress=bar,
                workers=None if by.workers is None else whole_number("--workers", by.workers, 1, MOST_WORKERS),
                quantities=None if kept.keep is None else [name.strip() for name in kept.keep.split(",")],
                at_set_point=kept.at_set_point,
                store=output if in_blocks else None,
                client=by.cluster,
                resume=resume if in_blocks else df.read(output) if resume else None,
            )
        seconds = time.monotonic() - start
        stopped = bool(result.attrs.get("interrupted"))
        counts = counted(result)
        if stopped and not in_blocks and set(counts) == {df.Status.NOT_COMPUTED}:
            say("dforce: stopped before the first case was finished; nothing was written")
            return STOPPED
        if not in_blocks:
            outputs.keep(result, Path(output))
        else:
            outputs.written.append(output)
    outputs.draw(lambda sheet: df.plot.overview(result, sheet))
    bad = {df.Status.FAILED, df.Status.UNRESOLVED, df.Status.INACCURATE, df.Status.BROKEN}
    failed = bool(bad & set(counts))
    code = STOPPED if stopped or late.asked else SOME_POINTS_FAILED if failed else DONE
    if printed.json:
        print_json(
            _answer(
                source,
                result,
                output if output in outputs.written else None,
                outputs.picture,
                seconds,
                outputs.code(code),
            )
        )
    elif not printed.quiet:
        for line in _lines(source, result, "" if resume else f" in {seconds:.3g} s"):
            tell(line)
        if outputs.written:
            typer.echo(f"written: {', '.join(outputs.written)}")
        for line in [*status_lines(result), *result.attrs.get("notes", "").splitlines()]:
            say(line)
        for line in advice_lines(result, case, output if output in outputs.written else None):
            say(line)
    if stopped:
        share = [] if kept.at_set_point is None else [f"--at-set-point {kept.at_set_point}"]
        again = ["dforce sweep", quoted(case), *(f"--set {quoted(setting)}" for setting in settings)]
        on = f"continue with: {' '.join([*again, '-o', quoted(output), *share, '--resume'])}"
        if share and not in_blocks:
            on = "with --at-set-point only a store can be continued: write -o OUT.zarr"
        if output in outputs.written:
            say(f"dforce: stopped; finished cases are kept; {on}")
    return outputs.end(code)


def _lines(source: Source, result: xr.Dataset, took: str) -> list[str]:
    """Return the results of a sweep, in lines for a reader."""
    sizes = ", ".join(f"{name} {size}" for name, size in result["status"].sizes.items())
    points = int(result["status"].size)
    done = points - counted(result).get(df.Status.NOT_COMPUTED, 0)
    share = f"{points}" if done == points else f"{done} of {points}"
    lines = [source.case.title] if source.case.title else []
    if "crossing" in result.dims:
        from dforce.findings.motions import set_point_not_met  # loads NumPy, which help does without

        missing = set_point_not_met(result)
        lines += [f"{missing.label}: {missing.text}"] if missing.value else []
    states = [_shown(result, state) for state in _states(result, NONE)]
    if len(states) > MOST_LINES:
        states = [f"{len(states)} states at the set point; draw them with --plot, or by dforce plot"]
    return [*lines, f"{share} points{took}, over {sizes}", *states]


def _states(result: xr.Dataset, none: str = "") -> Iterator[dict[str, Any]]:
    """Give the states at the set point of a sweep: the values of the case and of the state, in SI.

    `none` replaces a peak force below its estimated error, where it is given.
    """
    import numpy as np

    from dforce.results.significance import is_none

    if "crossing" not in result.dims:
        return
    names = (*result["zc"].dims[:-1], *("zc", "peak_force", "phase", "direction", "regime"))
    faint = is_none(result, "peak_force") if none and "peak_force" in result else None
    for place in np.argwhere(np.isfinite(result["zc"].values)):
        one = result.isel(dict(zip(result["zc"].dims, place.tolist(), strict=True)))
        state = {str(name): np.ravel(one[name].values.tolist())[0].item() for name in names if name in one.variables}
        yield state | ({"peak_force": none} if faint is not None and faint[tuple(place)] else {})


def _shown(result: xr.Dataset, state: dict[str, Any]) -> str:
    """Return a state at the set point in a line."""
    from dforce.findings.finding import number

    units = {name: str(result[name].attrs.get("units", "1")) for name in state}
    texts = {name: value if isinstance(value, str) else number(value, units[name]) for name, value in state.items()}
    is_named = {name: value == NONE or not isinstance(value, str) for name, value in state.items()}
    return ", ".join(f"{name} {text}" if is_named[name] else text for name, text in texts.items())


def _answer(
    source: Source, result: xr.Dataset, written: str | None, plot: Path | None, seconds: float, code: int
) -> dict[str, Any]:
    """Return the JSON."""
    return {
        "title": source.case.title,
        "file": written,
        "picture": None if plot is None else str(plot),
        "seconds": round(seconds, 3),
        "exit_code": code,
        "sizes": {str(name): size for name, size in result.sizes.items()},
        "at_set_point": list(_states(result)),
        **{key: value for key, value in as_json(result).items() if key in ("points", "advice")},
    }
