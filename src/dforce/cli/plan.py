"""`dforce plan`: the settings at which limits hold, from a case file with a table [plan]."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import dforce as df
from dforce.cli._names import inputs_of
from dforce.cli._options import Json, Quiet, option
from dforce.cli._outputs import Outputs
from dforce.cli._report import advice_as_json, advice_lines, advice_of
from dforce.cli._terminal import DONE, SOME_POINTS_FAILED, STOPPED, print_json, say, tell
from dforce.core.files import noted
from dforce.core.progress import ProgressBar
from dforce.core.stopping import late_stop_waits


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
    from dforce.findings import plans

    with noted() as files:
        asked = df.load_plan(file)
    outputs = Outputs(plot, output=output, spare=inputs_of(asked.case, files))
    with late_stop_waits():  # until the result is written
        with ProgressBar(asked.case.title or file.stem, shown=not quiet) as bar:
            found = df.plan(asked.case, asked.vary, asked.set_points, asked.limits, asked.goal, progress=bar)
        outputs.keep(found, output)
    outputs.draw(lambda sheet: df.plot.plan(found, sheet))
    points, states = plans.named(found), plans.states(found)
    allowed = int(found["allowed"].sum())
    stopped = bool(found.attrs.get("interrupted"))
    code = STOPPED if stopped else DONE if allowed else SOME_POINTS_FAILED
    if json:
        said = found.attrs.get("findings", "").splitlines()
        counts = {"allowed": allowed, "states": states, "exit_code": outputs.code(code)}
        print_json({**counts, "findings": said, "advice": advice_as_json(advice_of(found)), **points})
        return outputs.end(code)
    if not quiet:
        tell(f"{allowed} of {states} states are allowed")
        for name in points:
            tell(f"{plans.NAMED[name]}: {plans.in_words(found, name)}")
        for sentence in found.attrs.get("findings", "").splitlines():
            tell(sentence)
        written = outputs.written
        if written:
            typer.echo(f"written: {', '.join(written)}")
        for line in advice_lines(found, "", output if str(output) in written else None):
            say(line)
    if stopped:
        say("dforce: stopped; the states are kept, without margins, boundaries and a recommended point")
    elif not allowed:
        say(f"dforce: no setting is allowed; the limit that fails is {points['least_violation']['limit_hit']}")
    return outputs.end(code)
