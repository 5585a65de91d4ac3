"""`dforce models`: the force models, from the same declarations as everything else."""

from __future__ import annotations

import inspect
import re
import sys
import textwrap
from pathlib import Path
from typing import Annotated, Any, get_args

import typer

import dforce as df
from dforce.cli._names import complete_models
from dforce.cli._options import Json
from dforce.cli._terminal import BAD_INPUT, DONE, columns, console, print_json, width, wrapped
from dforce.core.errors import short_for
from dforce.core.notation import first_sentence, plain_math, unmarked

ZERO = re.compile(r"^0 .*")  # a zero with its unit


def models(
    name: Annotated[
        str | None,
        typer.Argument(
            autocompletion=complete_models,
            show_default=False,
            metavar="[NAME|WORD]",
            help="Show the page of this model, or list the models that mention this word.",
        ),
    ] = None,
    file: Annotated[
        Path | None, typer.Argument(metavar="[FILE.py]", show_default=False, help="After check: your file with models.")
    ] = None,
    long: Annotated[bool, typer.Option("--long", "-l", help="Also list the parameters of each model.")] = False,
    json: Json = False,
) -> int:
    """List the force models, or show one: equation, domain, parameters, source.

    dforce models check FILE.py runs every check over the force models in your file.
    """
    registry = df.forces.REGISTRY
    if name == "check":
        return _check(file, json)
    if file is not None:
        raise df.ParameterError("only one model is shown at a time; to check a file type dforce models check FILE.py")
    if name is None:
        if json:
            print_json([_described(model) for model in registry.values()])
        else:
            _list(list(registry.values()), long)
        return DONE
    short = short_for(name[:100], registry)
    model = registry[short[0]] if len(short) == 1 else None
    found = [registry[one] for one in short] or _mentioning(name.lower())
    if model is None and not found:
        model = registry[name]  # raises
    if json:
        print_json([_described(one) for one in found] if model is None else _described(model))
    elif model is None:
        _list(found, long)
    else:
        _page(model)
    return DONE


def _mentioning(word: str) -> list[type[df.Force]]:
    """Return the models with a word of at least three letters in name or summary, else in the group, else in the page."""
    tiers: tuple[list[type[df.Force]], ...] = ([], [], [])
    for title, members in df.forces.grouped(df.forces.REGISTRY.values()).items():
        for model in members:
            page = model.__doc__ or ""
            kind = "memory" if model.evolve else ""
            head = f"{model.name} {model.also_called} {model.contains} {kind} {first_sentence(page)}"
            for tier, text in zip(tiers, (head, title, f"{page} {model.source}"), strict=True):
                tier += [model] if len(word) > 2 and word in text.lower() else []
    return next(filter(None, tiers), [])


def _check(file: Path | None, json: bool) -> int:
    """Run the checks over the models of a user's file and print the findings."""
    if file is None:
        raise df.ParameterError("name the file to check: dforce models check FILE.py")
    found: dict[str, list[str]] = {}
    for model in df.load_plugin(file):
        try:
            df.check_force(model)
            found[model.name] = []
        except df.ForceError as error:
            found[model.name] = [line.removeprefix(f"{model.name}: ") for line in str(error).splitlines()]
    if json:
        print_json([{"name": name, "problems": problems} for name, problems in found.items()])
    else:
        for name, problems in found.items():
            typer.echo("\n".join(f"{name}: {problem}" for problem in problems or ["passes every check"]))
    return BAD_INPUT if any(found.values()) else DONE


def _described(model: type[df.Force]) -> dict[str, Any]:
    """Return everything declared about a model."""
    keys = model.keys()
    return {
        "name": model.name,
        "also_called": list(model.also_called),
        "summary": first_sentence(model.__doc__ or ""),
        "description": inspect.cleandoc(model.__doc__ or ""),
        "parameters": [_parameter(model, key) for key in keys],
        "from_the_instrument": list(model.shared_fields().values()),
        "contains": list(model.contains),
        "dissipative": model.dissipative,
        "source": model.source,
    }


def _parameter(model: type[df.Force], key: str) -> dict[str, Any]:
    field, quantity = model.model_fields[key], model.quantities().get(key)
    about: dict[str, Any] = {"name": key, "meaning": field.description or "", "required": field.is_required()}
    if not field.is_required():
        about["default"] = field.default
    choices = [choice for choice in get_args(field.annotation) if isinstance(choice, str | int)]
    if choices:
        about["choices"] = choices
    if quantity is not None:
        about |= {"unit": quantity.unit, "symbol": quantity.symbol}
        about |= {
            bound: value
            for bound in ("low", "above", "high", "below")
            if (value := getattr(quantity, bound)) is not None
        }
    return about


def _list(models: list[type[df.Force]], long: bool) -> None:
    """Print the models in groups: one line each, or with their parameters."""
    terminal = console()
    column = 3 + max(len(model.name) for model in models)
    room = columns(sys.stdout)
    for title, members in df.forces.grouped(models).items():
        terminal.print(title, style="bold")
        for model in members:
            about = first_sentence(model.__doc__ or "")
            name = f"  {model.name}".ljust(column + 2)
            if long:
                terminal.print(wrapped(about, width(), name, " " * (column + 2)))
                _print_parameters(model)
            elif room is None:  # a pipe or a file gets the whole sentence
                terminal.print(name + about)
            else:
                terminal.print(name + textwrap.shorten(about, max(room - len(name), 4), placeholder=" …"))
        terminal.print()
    terminal.print(wrapped("equation, domain and source of a model: dforce models NAME", width()))
    if not long:
        terminal.print(wrapped("all models with their parameters: dforce models --long", width()))


def _print_parameters(model: type[df.Force]) -> None:
    keys = model.keys()
    for key in keys:
        console().print(wrapped(_line(_parameter(model, key)), width(), "      ", "          "))


def _line(about: dict[str, Any]) -> str:
    """Return a parameter in a line: name, unit, default, bounds."""
    text = about["name"]
    if about.get("unit", "1") != "1":
        text += f" ({about['unit']})"
    if about.get("choices"):
        text += f": {' | '.join(str(choice) for choice in about['choices'])}"
    words = ["required"] if about["required"] else []
    if about.get("default") not in (None, ""):
        words.append(f"default {_shown(about['default'])}")
    signs = {"low": "at least", "above": "above", "high": "at most", "below": "below"}
    # the name already has the unit
    words += [f"{sign} {ZERO.sub('0', _shown(about[bound]))}" for bound, sign in signs.items() if bound in about]
    return f"{text}: {', '.join(words)}" if words else text


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return " and ".join(map(_shown, value))
    if isinstance(value, float):
        return f"{value:g}"
    return str(value).lower() if isinstance(value, bool) else str(value)


def _page(model: type[df.Force]) -> None:
    terminal = console()
    terminal.print(model.name, style="bold")
    terminal.print(readable(model.__doc__ or "") + "\n")
    terminal.print("parameters", style="bold")
    keys = model.keys()
    for key in keys:
        about = _parameter(model, key)
        symbol = f"{plain_math(about['symbol'])}: " if about.get("symbol") else ""
        terminal.print(wrapped(_line(about), width(), "  ", "      "))
        terminal.print(wrapped(symbol + about["meaning"], width(), "      ", "      "))
    if not keys:
        terminal.print("  no own parameters")
    if model.shared_fields():
        given = f"from the instrument: {', '.join(model.shared_fields().values())}"
        terminal.print("\n" + wrapped(given, width()))
    if model.also_called:
        terminal.print(wrapped(f"also found as: {', '.join(model.also_called)}", width()))
    terminal.print(wrapped(f"interactions: {', '.join(model.contains) or 'unknown'}", width()))
    terminal.print(f"dissipates energy: {'yes' if model.dissipative else 'no'}")
    terminal.print(wrapped(f"source: {model.source}", width()))


def readable(docstring: str) -> str:
    """Return a docstring in reStructuredText as plain paragraphs and indented equations."""
    text = inspect.cleandoc(docstring)
    blocks: list[str] = []
    lines = text.split("\n")
    while lines:
        line = lines.pop(0)
        if line.startswith(".. math::"):
            body = [line.removeprefix(".. math::")]
            while lines and (not lines[0].strip() or lines[0].startswith(" ")):
                body.append(lines.pop(0))
            equation = plain_math("\n".join(body).replace("\n", " ").strip())
            blocks.append("\n".join(map(_fitted, textwrap.indent(equation, "    ").split("\n"))))
        elif line.strip():
            paragraph = [line]
            while lines and lines[0].strip() and not lines[0].startswith((".. ", "- ")):
                paragraph.append(lines.pop(0))
            hanging = "  " if line.startswith("- ") else ""
            words = unmarked(" ".join(part.strip() for part in paragraph))
            blocks.append(wrapped(words, width(), then=hanging))
    return "\n\n".join(blocks)


def _fitted(line: str) -> str:
    """Return a line of an equation, on several lines where it is too long for one."""
    margin = line[: len(line) - len(line.lstrip())]
    return line if len(line) <= width() else wrapped(line, width(), margin, margin + "    ")
