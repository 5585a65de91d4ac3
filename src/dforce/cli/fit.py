"""`dforce fit`: parameters of a case from measured curves, and the parameters that curves constrain."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import dforce as df
from dforce.cli._names import CaseName, Source, curve_of, open_source
from dforce.cli._options import PICTURE, Json, Quiet, Settings, option
from dforce.cli._outputs import Outputs
from dforce.cli._report import advice_as_json, advice_of, quoted
from dforce.cli._terminal import DONE, SOME_POINTS_FAILED, STOPPED, print_json, say, tell
from dforce.core.progress import ProgressBar
from dforce.core.stopping import late_stop_waits

if TYPE_CHECKING:
    import xarray as xr

KNOWN = ("sample", "prior", "all")


def fit(
    case: CaseName,
    settings: Settings,
    data: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="DATA...", show_default=False, help="Files of measured curves; default: the file under [data]."
        ),
    ] = None,
    output: Annotated[Path | None, option("--output -o", "FIT.nc|FIT.csv", "File for the fit.")] = None,
    plot: Annotated[Path | None, option("--plot", PICTURE, "Draw data, model and residuals of one curve.")] = None,
    identify: Annotated[
        bool, typer.Option("--identify", help="Predict the errors of a fit, without a measurement.")
    ] = False,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Fit parameters of a case, with errors, to measured curves of amplitude and phase.

    The table [fit] of the case lists the parameters. CASE may be a fit, to repeat it. Ctrl-C keeps the best values so far. Exit
    code 1: fitted, with advice. Each file, and each curve in a file, has its own fit; a bad curve does not stop the others.
    """
    source = open_source(case, settings)
    again = source.result is not None and source.result.attrs.get("kind") == "fit"
    if source.case.fit is None and not again:
        raise df.ParameterError(f'{quoted(case)} has no table [fit]; add it, such as free = ["sample.youngs_modulus"]')
    files = list(dict.fromkeys(data or []))
    outputs = Outputs(plot, output=output, spare=[*map(Path, files), *source.inputs])
    if identify:
        return _identify(source, output, json, quiet)
    inputs = files if files or again else [str(path) for path in curve_of(source.case)]
    if len(inputs) > 1 or (inputs and _holds_several(source.case, inputs[0])):
        if plot is not None:
            raise df.ParameterError("--plot draws the fit of one curve; name one file")
        return _many(source, inputs, output, json, quiet)
    with late_stop_waits():
        with ProgressBar(source.case.title or source.stem, shown=not quiet) as bar:
            if again and not files and source.result is not None:
                result = df.fit_again(source.result, progress=bar)
            else:
                result = df.fit(source.case, files[0] if files else None, progress=bar)
        outputs.keep(result, output)
    outputs.draw(lambda sheet: df.plot.fit(result, sheet))
    written = outputs.written
    stopped = bool(result.attrs.get("interrupted"))
    code = STOPPED if stopped else SOME_POINTS_FAILED if advice_of(result) else DONE
    if json:
        print_json({**_answer(result), "files": written, "exit_code": outputs.code(code)})
    elif not quiet:
        tell(df.fit_report(result))
        if written:
            typer.echo(f"written: {', '.join(written)}")
    if stopped:
        say("dforce: stopped; these are the best values so far")
    return outputs.end(code)


def _holds_several(case: df.Case, file: str) -> bool:
    """Return whether a file contains several curves, and the case chooses none."""
    from dforce.inverse.fitting.load import reading_of
    from dforce.inverse.measured import each_curve

    return len(each_curve(file, {} if case.data is None else reading_of(case.data))) > 1


def _identify(source: Source, output: Path | None, json: bool, quiet: bool) -> int:
    """Print the parameters that curves of a case constrain."""
    experiment = source.case.experiment
    zc = experiment.zc if isinstance(experiment, df.experiments.Approach) else None
    errors = {} if source.case.fit is None else source.case.fit.errors
    result = df.identify(
        source.case, zc, errors={name: value for name, value in errors.items() if value != "from free part"}
    )
    outputs = Outputs()
    outputs.keep(result, output)
    if json:
        print_json(
            {
                "curves": result["curve"].values.tolist(),
                "known": result["known"].values.tolist(),
                "parameters": result["parameter"].values.tolist(),
                "units": result["unit"].values.tolist(),
                "error": result["error"].values.tolist(),
                "verdict": result["verdict"].values.tolist(),
                "products": result.attrs["products"].splitlines(),
            }
        )
        return outputs.end(DONE)
    words = {"sample": "an exact instrument", "prior": "A0 to 0.5 %, Q to 2 %, the phase offset to 0.5 degrees"}
    for known in KNOWN if not quiet else ():
        tell(f"{words.get(known, 'A0, Q and the phase offset free, too')}:")
        tell(df.identify_report(result, known) + "\n")
    if outputs.written and not quiet:
        typer.echo(f"written: {output}")
    return outputs.end(DONE)


def _many(source: Source, files: list[str], output: Path | None, json: bool, quiet: bool) -> int:
    """Fit many curves, and print a table."""
    with ProgressBar(source.case.title or source.stem, shown=not quiet) as bar:
        result = df.fit_many(source.case, {name: name for name in files}, progress=bar)
    outputs = Outputs()
    outputs.keep(result, output)
    messages = [text for text in result["message"].values.tolist() if text]
    whole = not result.attrs.get("interrupted")
    code = STOPPED if not whole else SOME_POINTS_FAILED if messages or bool(result["advised"].any()) else DONE
    if json:
        table = {
            name: result[name].values.tolist()
            for name in ("curve", "parameter", "unit", "value", "error", "chi2", "message", "doubt")
        }
        print_json({**table, "exit_code": outputs.code(code)})
        return outputs.end(code)
    if not quiet:
        tell(df.fit_report(result))
        if outputs.written:
            typer.echo(f"written: {output}")
    if not whole:
        say(f"dforce: stopped; finished curves: {result.sizes['curve']}")
    return outputs.end(code)


def _answer(result: xr.Dataset) -> dict[str, Any]:
    """Return the JSON of one fit."""
    from dforce.findings.fits import verdict  # loads NumPy, which help does without

    names = result["parameter"].values.tolist()
    every = (
        "value",
        "error",
        "error_low",
        "error_high",
        "interval_low",
        "interval_high",
        "error_given",
        "bootstrap_error",
        "start",
    )
    columns = [name for name in every if name in result]
    return {
        "title": result.attrs["title"],
        "verdict": verdict(result),
        "holds_for": result.attrs["holds_for"],
        **{name: result.attrs[name] for name in ("chi2", "degrees_of_freedom", "aic", "bic", "lost_points", "points")},
        "parameters": {
            name: {
                "unit": str(result["unit"].sel(parameter=name).values),
                "seen": bool(result["seen"].sel(parameter=name)),
                **{column: float(result[column].sel(parameter=name)) for column in columns},
            }
            for name in names
        },
        "correlation": result["correlation"].values.tolist(),
        "advice": advice_as_json(advice_of(result)),
    }
