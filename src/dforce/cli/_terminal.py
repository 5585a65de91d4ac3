"""What all commands share: printing on any terminal, errors as one sentence, exit codes."""

from __future__ import annotations

import codecs
import functools
import json
import math
import sys
import traceback
import unicodedata
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

import dforce as df

if TYPE_CHECKING:
    from rich.console import Console

DONE, SOME_POINTS_FAILED, BAD_INPUT, INSIDE_ERROR, STOPPED = 0, 1, 2, 3, 130

Traceback = Annotated[bool, typer.Option("--traceback", help="Show where in dForce an error arose.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for other programs.")]
Settings = Annotated[
    list[str],
    typer.Option(
        "--set", metavar="PATH=VALUE", default_factory=list, show_default=False,
        help='Change a value of the case, such as sample.youngs_modulus="2 GPa"; may be repeated.',
    ),
]  # fmt: skip

PLAIN = {
    "°": " deg", "µ": "u", "μ": "u", "–": "-", "—": "-", "−": "-", "×": "x", "·": " ", "√": "sqrt ",
    "←": "<-", "→": "->", "²": "^2", "³": "^3", "≤": "<=", "≥": ">=", "≈": "~", "∞": "infinity",
    "\N{COMBINING DOT ABOVE}": "'", "\N{COMBINING MACRON}": "_bar",
}  # fmt: skip


def plain(error: UnicodeError) -> tuple[str, int]:
    """Spell out what a terminal's character set lacks: µ as u, δ as delta."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    spelled = []
    for character in error.object[error.start : error.end]:
        name = unicodedata.name(character, "")
        if character in PLAIN:
            spelled.append(PLAIN[character])
        elif name.startswith("GREEK"):
            spelled.append(name.split()[3].lower())
        else:
            decomposed = unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()
            spelled.append(decomposed or "?")
    return "".join(spelled), error.end


def never_fail_to_print() -> None:
    """Make both output streams spell out characters that they cannot encode."""
    codecs.register_error("dforce-plain", plain)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="dforce-plain")


def console(stderr: bool = False) -> Console:
    """Return a console that prints text as it is, on the stream that is in use now."""
    from rich.console import Console

    return Console(
        file=sys.stderr if stderr else sys.stdout, highlight=False, markup=False, emoji=False, soft_wrap=True
    )


def say(text: str) -> None:
    """Print lines on stderr; control characters that came with a name or a title stay out."""
    typer.echo("".join(c if c.isprintable() or c == "\n" else "?" for c in text), err=True)


def print_json(content: Any) -> None:
    """Print JSON in ASCII; what is not finite becomes null, which every reader understands."""
    typer.echo(json.dumps(_finite(content), indent=2))


def _finite(content: Any) -> Any:
    if isinstance(content, dict):
        return {str(key): _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


def guarded(command: Callable[..., int]) -> Callable[..., None]:
    """Turn a command's result into the exit code, and its errors into one sentence on stderr.

    The command's own `traceback` option is read here: it shows where the error arose.
    """

    @functools.wraps(command)
    def guard(*args: Any, **kwargs: Any) -> None:
        try:
            raise typer.Exit(command(*args, **kwargs))
        except df.DForceError as error:
            say(f"dforce: {error}")
            code = BAD_INPUT
            cause: Exception = error
        except KeyboardInterrupt:
            say("dforce: stopped")
            raise typer.Exit(STOPPED) from None
        except (typer.Exit, BrokenPipeError):  # a broken pipe: its reader has seen enough
            raise
        except Exception as error:
            say(f"dforce: an error inside dForce, please report it: {type(error).__name__}: {error}")
            code, cause = INSIDE_ERROR, error
        if kwargs.get("traceback"):
            traceback.print_exception(cause)
        raise typer.Exit(code)

    return guard
