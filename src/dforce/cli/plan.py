"""`dforce plan`: the settings at which limits hold, from a case file with a table [plan]."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import dforce as df
from dforce.cli._names import inputs_of
from dforce.cli._options import Json, Quiet, option
from dforce.cli._outputs import Outputs
from dforce.cli._terminal import DONE, SOME_POINTS_FAILED, STOPPED, print_json, say, tell
from dforce.core.files import noted
from dforce.core.progress import ProgressBar
from dforce.core.stopping import late_stop_waits

if TYPE_CHECKING:
    import xarray as xr

NAMED = {"recommended": "most room", "best": "best by the goal", "least_violation": "least violation"}
TOLD = ("phase", "peak_force", "max_indentation", "contact_time")


def plan(
    file: Annotated[
        Path, typer.Argument(metavar="PLAN.toml", show_default=False, help="A case file with a table [plan].")
    ],
    output: Annotated[Path | None, option("--output -o", "MAP.nc", "File for the plan; default: none.")] = None,
    plot: Annotated[Path | None, option("--plot", "MAP.png|.pdf|.svg", "Draw the plan.")] = None,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Find settings within your limits, and recommend the setting with the largest margin.

    Exit code 1: no setting is allowed. dForce then prints the limit that fails and the point of least violation. Ctrl-C keeps
    the solved states.
    """
    with noted() as files:
        asked = df.load_plan(file)
    outputs = Outputs(plot, output=output, spare=inputs_of(asked.case, files))
    with late_stop_waits():  # until the result is written
        with ProgressBar(asked.case.title or file.stem, shown=not quiet) as bar:
            found = df.plan(asked.case, asked.vary, asked.set_points, asked.limits, asked.goal, progress=bar)
        outputs.keep(found, output)
    outputs.draw(lambda sheet: df.plot.plan(found, sheet))
    points = {name: _point(found, name) for name in NAMED if name in found and bool(found[name].any())}
    allowed = int(found["allowed"].sum())
    stopped = bool(found.attrs.get("interrupted"))
    code = STOPPED if stopped else DONE if allowed else SOME_POINTS_FAILED
    if json:
        said = found.attrs.get("findings", "").splitlines()
        print_json(
            {"allowed": allowed, "states": _states(found), "exit_code": outputs.code(code), "findings": said, **points}
        )
        return outputs.end(code)
    if not quiet:
        tell(f"{allowed} of {_states(found)} states are allowed")
        for name, point in points.items():
            tell(f"{NAMED[name]}: {_text(_at(found, name), point)}")
        for sentence in found.attrs.get("findings", "").splitlines():
            tell(sentence)
        written = outputs.written
        if written:
            typer.echo(f"written: {', '.join(written)}")
    if stopped:
        say("dforce: stopped; the states are kept, without margins, boundaries and a recommended point")
    elif not allowed:
        say(f"dforce: no setting is allowed; the limit that fails is {points['least_violation']['limit_hit']}")
    return outputs.end(code)


def _states(found: xr.Dataset) -> int:
    return int((found["limit_hit"] != "no state").sum())


def _at(found: xr.Dataset, name: str) -> xr.Dataset:
    """Return the point that a plan names so."""
    places = found[name].values.nonzero()
    return found.isel({dim: int(place[0]) for dim, place in zip(found[name].dims, places, strict=True)})


def _point(found: xr.Dataset, name: str) -> dict[str, Any]:
    """Return the point that a plan names so, SI values by name."""
    point, names = _at(found, name), [str(dim) for dim in found[name].dims if dim != "state"]
    values = {key: float(point[key]) for key in (*names, "zc")}
    values |= {key: float(point[key].values.ravel()[0]) for key in TOLD}
    return values | {
        "room": float(point["room"]),
        "regime": str(point["regime"].values),
        "limit_hit": str(point["limit_hit"].values),
    }


def _text(point: xr.Dataset, values: dict[str, Any]) -> str:
    """Return a point for a reader."""
    from dforce.findings.finding import number
    from dforce.results.significance import is_none

    words = []
    for name, value in values.items():
        if isinstance(value, str):
            words += [f"{name.replace('_', ' ')} {value}"] if value else []
            continue
        shown = number(value, str(point[name].attrs.get("units", "1")), name, bool(is_none(point, name).ravel()[0]))
        words.append(f"{name.replace('_', ' ')} {shown}{' margins' if name == 'room' else ''}")
    return ", ".join(words)
