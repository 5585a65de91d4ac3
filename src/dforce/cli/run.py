"""`dforce run`: from a case to a result, a picture and a table of findings."""

from __future__ import annotations

import dataclasses
import itertools
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import dforce as df
from dforce.cli._names import CaseName, Source, open_source
from dforce.cli._options import PICTURE, Printed, Settings, option
from dforce.cli._outputs import Outputs
from dforce.cli._report import (
    advice_lines,
    as_json,
    counted,
    print_findings,
    quoted,
    set_point_lines,
    states_lines,
    states_of,
    status_lines,
)
from dforce.cli._terminal import BAD_INPUT, DONE, SOME_POINTS_FAILED, STOPPED, print_json, say
from dforce.core.files import exists
from dforce.core.garbage import seldom_collected
from dforce.core.progress import ProgressBar
from dforce.core.stopping import late_stop_waits
from dforce.core.units import parse_share

if TYPE_CHECKING:
    import xarray as xr

# Distances of a case without an experiment, as shares of A0: down to a tenth of it. At a low quality factor the amplitude
# falls more slowly, and the lever presses the tip in.
OVER_A0 = {"of": "drive.A0", "start": 1.2}
CLOSE, BELOW, LOW_Q = 0.1, -0.5, 10.0


@seldom_collected()
def run(
    *,
    case: CaseName,
    settings: Settings,
    at_set_point: Annotated[
        str | None,
        option(
            "--at-set-point", "SHARES", 'Show the states at this A/A0, such as 0.8, "80 %" or 0.7,0.8. Default: 80 %.'
        ),
    ] = None,
    output: Annotated[
        Path | None,
        option(
            "--output -o",
            "OUT.nc|OUT.csv",
            "File for the result; replaces an older file. Default: NAME.nc; replaces only an older result of the same "
            "case. Beside another file: NAME-2.nc.",
        ),
    ] = None,
    plot: Annotated[Path | None, option("--plot", PICTURE, "Draw the result.")] = None,
    width: Annotated[str | None, option("--width", "WIDTH", 'Width of the picture, such as "85 mm".')] = None,
    states: Annotated[
        bool,
        typer.Option("--states", help="Also draw all states behind the curve of an approach, unstable states dashed."),
    ] = False,
    printed: Printed,
) -> int:
    """Run a case and write its result.

    CASE may be a result: a complete result is computed again, an interrupted result is continued. Ctrl-C and SIGTERM keep the
    finished points.
    """
    source = open_source(case, settings if at_set_point is None else [])
    if at_set_point is not None:
        source = dataclasses.replace(source, case=_at(source.case, settings, at_set_point), result=None)
    continued = source.result is not None and bool(source.result.attrs.get("interrupted"))
    over = "" if source.result is None else source.result.attrs.get("over", "")
    _refuse_sweep(case, source.case, over, continued)
    if output is None and continued:
        output = source.path
    outputs = Outputs(plot, width, output=output or _numbered(source.stem, 1), spare=source.inputs)
    if states:
        _check_states(source.case, plot)
    start = time.monotonic()
    with late_stop_waits() as late:  # until the result is written
        with ProgressBar(source.case.title or source.stem, shown=not printed.quiet) as bar:
            result = df.run(source.case, progress=bar, resume=source.result if continued else None)
        seconds = time.monotonic() - start
        if late.asked:  # nothing is left to be continued
            result.attrs.pop("interrupted", None)
        stopped = bool(result.attrs.get("interrupted"))
        if stopped and not _computed(result):
            say("dforce: stopped before the first point was finished; nothing was written")
            return STOPPED
        written = outputs.write(lambda: df.write(result, output) if output else _write_beside(result, source), result)
    outputs.draw(lambda sheet: df.plot.overview(result, sheet))  # it is kept even if the states fail
    found = None
    if states and outputs.picture is not None and not (stopped or late.asked):
        with outputs.attempt():
            found = _all_states(source.case, result, printed.quiet)
        if found is not None and not found.attrs.get("interrupted"):
            outputs.draw(lambda sheet: df.plot.overview(result, sheet, found))
    without = found is not None and bool(found.attrs.get("interrupted"))
    asks = not stopped and (at_set_point is not None or _asks_for_set_points(source))
    if stopped or without or late.asked:
        code = STOPPED
    elif asks and not any(states_of(result).values()):
        code = BAD_INPUT
    else:
        code = SOME_POINTS_FAILED if _failed(result) else DONE
    if printed.json:
        print_json(_answer(source, result, written, outputs.picture, seconds, outputs.code(code)))
    elif not printed.quiet:
        print_findings(result)
        if outputs.written:
            typer.echo(f"written: {', '.join(outputs.written)}")
    if not (printed.json or printed.quiet):
        for line in [
            *status_lines(result),
            *(set_point_lines(result) if asks else []),
            *states_lines(found),
            *advice_lines(result, case, written),
        ]:
            say(line)
    if stopped and written is not None:
        computed, points = _computed(result), _points(result)
        # how many states there are is known when all are found
        done = f"{computed} points" if computed == points else f"{computed} of {points} points"
        say(f"dforce: stopped; {done} are finished and kept{_how(written)}")
    if late.asked and not stopped:
        say("dforce: stopped; the result is complete and kept")
    if without:
        say("dforce: stopped during the search for states; the curve is complete, and drawn without them")
    return outputs.end(code)


def _at(case: df.Case, settings: list[str], shares: str) -> df.Case:
    """Return a case, changed by settings, that asks for set points; one without an experiment is approached and retracted."""
    each = [share.strip() for share in shares.split(",")]
    if "0" in each:
        raise df.ParameterError(f"--at-set-point = {shares} has a share of 0; write decimals with a point, such as 0.8")
    wanted = [parse_share(share, "--at-set-point") for share in each]
    if case.experiment is None:
        in_liquid = min(mode.Q for mode in case.problem.modes) < LOW_Q
        zc = OVER_A0 | {"stop": BELOW if in_liquid else CLOSE, "points": 221}
        case = case.replace("experiment", {"kind": "approach", "direction": "both", "zc": zc})
    case = case.set(*settings)
    if not hasattr(case.experiment, "set_point"):
        kind = "none" if case.experiment is None else case.experiment.kind
        raise df.ParameterError(
            f"--at-set-point goes with an approach or branches; this experiment is {kind}. "
            "Without [experiment] dForce runs an approach and retract from 1.2 A0"
        )
    return case.replace("experiment.set_point", wanted)


def _asks_for_set_points(source: Source) -> bool:
    """Return whether a case itself names its set points; the case in a result names every default."""
    given = source.path is None or source.path.suffix == ".toml"
    return given and source.case.experiment is not None and "set_point" in source.case.experiment.model_fields_set


def _refuse_sweep(name: str, case: df.Case, over: str, continued: bool) -> None:
    """Raise ResultError or ParameterError for many cases, with the command that computes them."""
    if over:
        first, *_ = over.split()
        how = "df.sweep(..., resume=...) continues" if continued else "df.sweep repeats"
        how = how + " in Python" if case.sweep is None else f"dforce sweep {'continues' if continued else 'repeats'}"
        raise df.ResultError(
            f"{quoted(name)} is a sweep over {over.replace(' ', ', ')}, which {how}; "
            f"to run one case of it, write its value: --set {first}=..."
        )
    if case.sweep is not None:
        raise df.ParameterError(
            f"{quoted(name)} has a table [sweep] with many cases; type "
            f"dforce sweep {quoted(name)} -o {quoted(f'{Path(name).stem}.nc')}"
        )


def _check_states(case: df.Case, plot: Path | None) -> None:
    """Raise ParameterError where states cannot be drawn behind the result of a case."""
    if plot is None:
        raise df.ParameterError("--states needs a picture; also write --plot")
    if not isinstance(case.experiment, df.experiments.Approach):
        kind = "none" if case.experiment is None else case.experiment.kind
        raise df.ParameterError(f"--states needs the curve of an approach; this experiment is {kind}: remove --states")
    if len(set(case.experiment.distances(case.problem.tones[0].A0).tolist())) == 1:
        raise df.ParameterError("--states needs a range of distances; this approach has only one distance")


def _all_states(case: df.Case, curve: xr.Dataset, quiet: bool) -> xr.Dataset:
    """Return all states over the distances of a curve."""
    with ProgressBar("all states", shown=not quiet) as bar:
        return df.branches(case, zc=(float(curve["zc"].max()), float(curve["zc"].min())), progress=bar)


def _numbered(stem: str, number: int) -> Path:
    return Path(f"{stem}.nc" if number == 1 else f"{stem}-{number}.nc")


def _write_beside(result: xr.Dataset, source: Source) -> Path:
    """Write to the name of the case; with a number where the name is taken, unless by a run of the same case.

    The file that a run was started from stays, and a stopped run replaces nothing.
    """
    for number in itertools.count(1):
        path = _numbered(source.stem, number)
        again = (
            not result.attrs.get("interrupted")
            and not (source.path is not None and exists(path) and path.samefile(source.path))
            and _holds_the_same(path, result)
        )
        try:
            return df.write(result, path, overwrite=again)
        except FileExistsError:  # the name of another one, perhaps of a process that took it in this moment
            continue
    raise AssertionError("numbers do not end")


def _holds_the_same(path: Path, result: xr.Dataset) -> bool:
    """Return whether a file contains a run of the same case by the same version."""
    try:
        earlier = df.read(path)
    except df.ResultError:
        return False
    same = all(earlier.attrs.get(key) == result.attrs.get(key) for key in ("case", "dforce_version", "over"))
    return same and set(earlier.dims) == set(result.dims)  # a force curve holds its case, too


def _points(result: xr.Dataset) -> int:
    return sum(counted(result).values())


def _computed(result: xr.Dataset) -> int:
    return _points(result) - counted(result).get(df.Status.NOT_COMPUTED, 0)


def _failed(result: xr.Dataset) -> bool:
    return bool({df.Status.FAILED, df.Status.UNRESOLVED, df.Status.INACCURATE} & set(counted(result)))


def _how(written: Path) -> str:
    """Return the words on how to continue an interrupted run."""
    return (
        f"; continue with: dforce run {quoted(str(written))}"
        if written.suffix == ".nc"
        else "; only a .nc file can be continued"
    )


def _answer(
    source: Source, result: xr.Dataset, written: Path | None, plot: Path | None, seconds: float, code: int
) -> dict[str, Any]:
    """Return the JSON."""
    return {
        "title": source.case.title,
        "kind": source.case.experiment.kind if source.case.experiment is not None else "",
        "file": written and str(written),
        "picture": None if plot is None else str(plot),
        "seconds": round(seconds, 3),
        "exit_code": code,
        **as_json(result),
    }
