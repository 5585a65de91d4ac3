"""The program as it explains itself: pages of help, and mistakes in the words typed, in dForce's own voice."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterable, Iterator
from typing import Any

import typer
import typer.core

import dforce as df
from dforce.cli._terminal import BAD_INPUT, DONE, STOPPED, say, width, wrapped
from dforce.core.errors import nearest, shorten

USAGE_ERROR: type[Exception] = typer.BadParameter.mro()[1]  # of all mistakes in the words typed; it has no public name
SECTIONS = ("Arguments", "Options")


class Command(typer.core.TyperCommand):
    """A command whose page of help ends its lines between words."""

    allow_extra_args = True  # so that a sentence names the superfluous argument

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        if ctx.args:
            raise df.ParameterError(f"'{shorten(ctx.args[0])}' is one word too many; see {ctx.command_path} --help")
        return super().invoke(ctx)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the page."""
        formatter.write(page(ctx))


class Program(typer.core.TyperGroup):
    """The program: its page of help, and its answer to a mistake, a sentence like any other."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the page."""
        formatter.write(page(ctx))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command that is meant; an unknown one is answered with the nearest."""
        if args[0] not in self.commands and not args[0].startswith("-") and not ctx.resilient_parsing:
            raise df.ParameterError(
                f"there is no command '{shorten(args[0])}'{nearest(args[0][:100], self.commands, 'dforce --help')}"
            )
        return super().resolve_command(ctx, args)

    def main(self, *args: Any, **options: Any) -> Any:
        """Run the program and exit."""
        try:
            code = super().main(*args, **options | {"standalone_mode": False})
        except df.DForceError as error:
            say(f"dforce: {error}")
            code = BAD_INPUT
        except USAGE_ERROR as error:
            say(f"dforce: {_sentence(error)}")
            code = BAD_INPUT
        except typer.Abort:
            say("dforce: stopped")
            code = STOPPED
        sys.exit(code or DONE)


def _sentence(error: Any) -> str:
    """Return a mistake in the options of a command as one sentence."""
    context = error.ctx
    if context is not None and hasattr(error, "possibilities"):
        known = [name for parameter in context.command.params for name in _names(parameter)]
        hint = nearest(error.option_name[:100], known, f"{context.command_path} --help")
        return f"there is no option '{shorten(error.option_name)}'{hint}"
    text = error.format_message().rstrip(".")
    more = "" if context is None else f"; see {context.command_path} --help"
    return f"{text[:1].lower()}{text[1:]}{more}"


def page(ctx: Any) -> str:
    """Return a command's page of help: its usage, its purpose, its arguments, options and commands."""
    room, command = width(), ctx.command
    about = inspect.cleandoc(command.help or "").split("\n\n")
    parts = [wrapped(f"Usage: {ctx.command_path} {_usage(command)}", room, then="    ")]
    parts += [wrapped(paragraph, room) for paragraph in about]
    given: dict[str, list[tuple[str, str]]] = {section: [] for section in SECTIONS}
    for parameter in command.get_params(ctx):
        if not getattr(parameter, "hidden", False):
            section = SECTIONS[parameter.param_type_name != "argument"]
            given[section].append((_shown(parameter), _explained(parameter)))
    commands = getattr(command, "commands", {})
    given["Commands"] = [(name, _summary(one)) for name, one in commands.items()]
    parts += [f"{title}:\n{_rows(rows, room)}" for title, rows in given.items() if rows]
    return "\n\n".join(parts) + "\n"


def _summary(command: Any) -> str:
    return inspect.cleandoc(command.help or "").split("\n\n")[0]


def _usage(command: Any) -> str:
    words = ["[OPTIONS]"]
    if getattr(command, "commands", None):
        return " ".join([*words, "COMMAND ..."])
    for parameter in command.params:
        if parameter.param_type_name == "argument":
            words.append(_shown(parameter) if parameter.required else f"[{_shown(parameter)}]")
    return " ".join(words)


def _names(parameter: Any) -> list[str]:
    return [*parameter.opts, *parameter.secondary_opts] if parameter.param_type_name == "option" else []


def _shown(parameter: Any) -> str:
    """Return a parameter as it is typed: a short name first, then its value."""
    if parameter.param_type_name == "argument":
        return str(parameter.metavar or parameter.name.upper()).strip("[]")
    names = ", ".join(sorted(_names(parameter), key=lambda name: name.startswith("--")))
    return names if parameter.is_flag else f"{names} {parameter.metavar or 'VALUE'}"


def _explained(parameter: Any) -> str:
    text = parameter.help or ""
    told = parameter.show_default and not getattr(parameter, "is_flag", False) and parameter.default
    return f"{text} [default: {parameter.default}]" if told else text


def _rows(rows: Iterable[tuple[str, str]], room: int) -> str:
    """Return names with their explanations beside them, below where a name is too long for that."""
    return "\n".join(_laid_out(list(rows), room))


def _laid_out(rows: list[tuple[str, str]], room: int) -> Iterator[str]:
    most = room // 3
    column = 4 + max((len(name) for name, _ in rows if len(name) <= most), default=4)
    for name, text in rows:
        start = f"  {name}"
        if len(name) > most:
            yield start
            start = ""
        yield wrapped(text, room, start.ljust(column), " " * column) or start  # python -OO leaves no texts
