"""The common part of all commands: printing on any terminal, errors as one sentence, exit codes."""

from __future__ import annotations

import functools
import inspect
import json
import math
import os
import sys
import textwrap
import traceback
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TextIO

import typer

import dforce as df
from dforce.cli._options import gathered, parameters
from dforce.core.errors import ChangedResultError, shorten
from dforce.core.log import listening
from dforce.core.stopping import heard

if TYPE_CHECKING:
    from rich.console import Console

DONE, SOME_POINTS_FAILED, BAD_INPUT, INSIDE_ERROR, STOPPED = 0, 1, 2, 3, 130
WIDEST = 96  # columns of a paragraph that is easy to read
USUAL = 80  # columns of a terminal of unknown width


def console() -> Console:
    """Return a console that prints text as it is on stdout, the stream that is in use now."""
    from rich.console import Console

    return Console(file=sys.stdout, highlight=False, markup=False, emoji=False, soft_wrap=True)


def columns(stream: TextIO) -> int | None:
    """Return the columns of the terminal behind a stream; None for a file or a pipe, where a line may be of any length."""
    asked = os.environ.get("COLUMNS", "")
    if asked.isdecimal() and int(asked) > 0:
        return int(asked)
    try:
        return os.get_terminal_size(stream.fileno()).columns or None
    except (OSError, ValueError):  # no terminal, or not even a file
        return None


def width() -> int:
    """Return the columns of a paragraph on stdout."""
    return min(columns(sys.stdout) or USUAL, WIDEST)


def wrapped(text: str, room: int, first: str = "", then: str = "") -> str:
    """Return prose in lines of at most `room` columns that start with `first`, all others with `then`.

    A line ends between two words, never inside a word: a name, a number or a path can be copied.
    """
    return textwrap.fill(
        text, room, initial_indent=first, subsequent_indent=then, break_long_words=False, break_on_hyphens=False
    )


def printable(text: str) -> str:
    """Return text without the control characters that came with a name or a title."""
    return "".join(c if c.isprintable() or c == "\n" else "?" for c in text)


def say(text: str) -> None:
    """Print sentences on stderr, each on its own line, wrapped on a terminal."""
    typer.echo(_in_lines(text, sys.stderr), err=True)


def tell(text: str) -> None:
    """Print lines on stdout, wrapped to the width of a terminal."""
    typer.echo(_in_lines(text, sys.stdout, "    "))


def _in_lines(text: str, stream: TextIO, then: str = "") -> str:
    room, lines = columns(stream), printable(text).split("\n")
    if room is not None:
        room = min(room, WIDEST)
        lines = [line if len(line) <= room else wrapped(line, room, then=then) for line in lines]
    return "\n".join(lines)


def print_json(content: object) -> None:
    """Print JSON in ASCII; a number that is not finite becomes null, which every reader understands."""
    typer.echo(json.dumps(_finite(content), indent=2))


def whole_number(option: str, text: str, least: int, most: int) -> int:
    """Return the number of an option from its text."""
    if not text.isdecimal() or len(text) > len(str(most)) or not least <= int(text) <= most:
        raise df.ParameterError(f"{option} is '{shorten(text)}', not a whole number from {least} to {most}")
    return int(text)


def _finite(content: object) -> Any:
    if isinstance(content, dict):
        return {str(key): _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


def exit_code(error: BaseException) -> int:
    """Return the exit code of an error that ended a command."""
    if isinstance(error, KeyboardInterrupt):
        return STOPPED
    is_inside = isinstance(error, ChangedResultError) or not isinstance(error, df.DForceError | MemoryError)
    return INSIDE_ERROR if is_inside else BAD_INPUT


def guarded(command: Callable[..., int]) -> Callable[..., None]:
    """Turn a command's result into the exit code, and its errors into one sentence on stderr.

    Each command has the option `--traceback`, which shows where the error arose. Each message during the work is printed
    once: two kernels may be compiled in parts, in turn.
    """
    options = list(parameters(command))

    @functools.wraps(command)
    def guard(**given: Any) -> None:
        traced = given.pop("traceback", False)
        said: set[str] = set()

        def notice(text: str) -> None:
            if text not in said:
                said.add(text)
                say(text)

        try:
            with listening(notice):
                raise typer.Exit(command(**gathered(command, given)))
        except df.DForceError as error:
            say(f"dforce: {error}")
            cause: Exception = error
        except MemoryError as error:
            say(f"dforce: not enough memory ({error}); compute fewer points, or choose a part of the result by .isel")
            cause = error
        except KeyboardInterrupt:
            heard()
            say("dforce: stopped")
            raise typer.Exit(STOPPED) from None
        except typer.Exit:
            raise
        except Exception as error:  # any error ends in one sentence  # noqa: BLE001
            say(f"dforce: an error inside dForce, please report it: {type(error).__name__}: {error}")
            cause = error
        if traced:
            traceback.print_exception(cause)
        raise typer.Exit(exit_code(cause))

    guard.__annotations__ = {one.name: one.annotation for one in options}
    guard.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]
    return guard
