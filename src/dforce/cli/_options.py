"""Options that commands share, and dataclasses of options that belong together."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, get_type_hints

import typer

PICTURE = "FIG.png|.pdf|.svg"


def option(names: str, metavar: str, about: str) -> Any:
    """Return an option that takes a value, by its names on the command line."""
    return typer.Option(*names.split(), metavar=metavar, show_default=False, help=about)


Traceback = Annotated[bool, typer.Option("--traceback", help="Show where in dForce an error arose.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for other programs.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


def repeated(names: str, metavar: str, about: str) -> Any:
    """Return an option that may be repeated."""
    return typer.Option(
        *names.split(), metavar=metavar, default_factory=list, show_default=False, help=f"{about}; may be repeated."
    )


Settings = Annotated[
    list[str], repeated("--set", "PATH=VALUE", 'Change a value of the case, such as sample.youngs_modulus="2 GPa"')
]


@dataclasses.dataclass(frozen=True)
class Printed:
    """How a command prints its answer."""

    json: Json = False
    quiet: Quiet = False


def groups(command: Callable[..., int]) -> dict[str, Any]:
    """Return the arguments of a command that are dataclasses of options, by name."""
    hints = get_type_hints(command, include_extras=True)
    return {name: hint for name, hint in hints.items() if dataclasses.is_dataclass(hint)}


def parameters(command: Callable[..., int]) -> Iterator[inspect.Parameter]:
    """Give the options of a command, with the fields of a dataclass one by one, and `--traceback`."""
    hints, grouped = get_type_hints(command, include_extras=True), groups(command)
    for name, parameter in inspect.signature(command).parameters.items():
        if name in grouped:
            inner = get_type_hints(grouped[name], include_extras=True)
            for field in inspect.signature(grouped[name]).parameters.values():
                yield field.replace(annotation=inner[field.name], kind=inspect.Parameter.KEYWORD_ONLY)
        else:
            yield parameter.replace(annotation=hints[name], kind=inspect.Parameter.KEYWORD_ONLY)
    yield inspect.Parameter("traceback", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Traceback)


def gathered(command: Callable[..., int], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of a command from the values of its options."""
    left, out = dict(given), {}
    for name, group in groups(command).items():
        out[name] = group(**{field.name: left.pop(field.name) for field in dataclasses.fields(group)})
    return left | out
