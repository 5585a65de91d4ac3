"""`dforce check`: advice where the models of a case, or its result, are misleading."""

from __future__ import annotations

import typer

import dforce as df
from dforce.cli._names import CaseName, open_source
from dforce.cli._options import Json, Settings
from dforce.cli._report import advice_as_json
from dforce.cli._terminal import DONE, console, print_json, width, wrapped


def check(case: CaseName, settings: Settings, json: Json = False) -> int:
    """Check whether the models of a case are valid, without a run.

    CASE may be a result: then the check includes its motion.
    """
    source = open_source(case, settings)
    pieces = df.advice(source.case, source.result)
    if json:
        print_json({"title": source.case.title, "advice": advice_as_json(pieces)})
    elif pieces:
        _print(pieces)
    else:
        typer.echo("nothing to say")
    return DONE


def _print(pieces: list[df.Advice]) -> None:
    """Print each piece of advice: its name, the text, the figures, their place and their source."""
    from rich.text import Text

    terminal = console()
    for number, piece in enumerate(pieces):
        terminal.print(Text(("\n" if number else "") + piece.name, style="bold"))
        for text in (piece.text, f"{piece.figures} ({', '.join(piece.about)})", f"source: {piece.source}"):
            terminal.print(wrapped(text, width(), "  ", "  "))
