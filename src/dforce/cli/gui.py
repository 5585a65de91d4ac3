"""`dforce gui`: the window."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Annotated

import typer

import dforce as df
from dforce.cli._names import complete_cases, open_source
from dforce.cli._options import option
from dforce.cli._terminal import DONE, whole_number


def gui(
    case: Annotated[
        str | None,
        typer.Argument(
            metavar="[CASE]",
            autocompletion=complete_cases,
            show_default=False,
            help="A case file, a result, a store or an example to open; default: your last project.",
        ),
    ] = None,
    window: Annotated[
        bool, typer.Option("--window", help="Open an application window instead of a page in the browser.")
    ] = False,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the browser, or only print the address.")
    ] = True,
    host: Annotated[
        str,
        typer.Option(
            "--host",
            metavar="ADDRESS",
            help="Address of the server; 0.0.0.0 opens the window to others on the network.",
        ),
    ] = "127.0.0.1",
    port: Annotated[str | None, option("--port", "NUMBER", "Port; default: 8571, or a free port.")] = None,
    folder: Annotated[
        Path | None, option("--folder", "FOLDER", "Folder for documents and results; default: in the user's data.")
    ] = None,
) -> int:
    """Open the window in your browser: forms, live curves and plots. It runs on this computer alone."""
    listening = None if port is None else whole_number("--port", port, 1, 65535)
    missing = [name for name in ("nicegui", "plotly") if importlib.util.find_spec(name) is None]
    if missing:
        raise df.ParameterError(
            f"the window needs {' and '.join(missing)}, but {'they are' if len(missing) > 1 else 'it is'} not installed; "
            'run: pip install "dforce[gui]"'
        )
    from dforce.gui.study.explore import is_explorable
    from dforce.gui.study.parameter_study import with_approach
    from dforce.gui.window.server import Options, serve

    source = None if case is None else open_source(case, [])
    over = source.result if source is not None and source.result is not None and is_explorable(source.result) else None
    opened = None if source is None else source.case if over is None else with_approach(source.case)
    file = None if case is None or not Path(case).is_file() else Path(case)
    show = "window" if window else "browser" if browser else "no"
    serve(Options(host=host, port=listening, show=show, case=opened, file=file, folder=folder, over=over))
    return DONE
