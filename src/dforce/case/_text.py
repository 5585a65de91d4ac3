"""A case as plain tables, and these as TOML text for people to read."""

from __future__ import annotations

import functools
from typing import Any

import tomli_w

from dforce.core import units
from dforce.core.parameter_quantity import ParameterQuantity
from dforce.core.parameters import Parameters
from dforce.core.toml import read_toml
from dforce.experiments import Experiment
from dforce.forces import Force

INLINE = 80  # characters; a longer table gets a section of its own
MANY = 20  # numbers in a list; a longer list has no units


def tables(given: Parameters, shown: bool = False, complete: bool = False) -> dict[str, Any]:
    """Return the set values as nested dicts and lists, from which an equal object can be built.

    Parameters
    ----------
    given
        A case, or any part of one.
    shown
        Quantities as text with a readable unit, except in long lists; else as SI numbers. Neither loses a digit.
    complete
        With the defaults too.
    """
    table: dict[str, Any] = {"model": given.name} if isinstance(given, Force) else {}
    quantities = given.quantities()
    for name in given.keys():  # noqa: SIM118 the method of Parameters
        value = getattr(given, name)
        wanted = complete or name in given.model_fields_set or (name == "kind" and isinstance(given, Experiment))
        if wanted and value is not None and value != ():
            table[name] = _plain(value, quantities.get(name), shown, complete)
    return table


def _plain(value: object, quantity: ParameterQuantity | None, shown: bool, complete: bool) -> Any:
    if isinstance(value, Parameters):
        return tables(value, shown, complete)
    if isinstance(value, dict):
        return {key: _plain(item, quantity, shown, complete) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(item, quantity, shown and len(value) <= MANY, complete) for item in value]
    if isinstance(value, float):
        value = float(value)  # a NumPy scalar prints its type
        if shown and quantity is not None and quantity.unit != "1":
            return units.show(value, quantity.unit)
        if shown and quantity is not None and value.is_integer() and abs(value) < 1e15:
            return int(value)
    return value


def text_of(case: Parameters, complete: bool) -> str:
    """Return a case as TOML: keys outside of sections first, then the sections."""
    table = tables(case, shown=True, complete=complete)
    for section in ("medium", "cantilever", "sample"):
        given = table.get(section)
        if isinstance(given, dict) and list(given) == ["name"]:
            table[section] = given["name"]
    sections = {name: part for name, part in table.items() if _is_table(part)}
    head = [_line(name, value) for name, value in table.items() if name not in sections]
    return (
        "\n\n".join(["\n".join(head)] * bool(head) + [text for n, p in sections.items() for text in _section(n, p)])
        + "\n"
    )


def _is_table(part: object) -> bool:
    return isinstance(part, dict) or (isinstance(part, list) and any(isinstance(item, dict) for item in part))


def _section(name: str, content: Any) -> list[str]:
    """Return the text of a section or a list of sections, each with its contents."""
    if isinstance(content, list):
        return ["\n".join([f"[[{name}]]", *(_line(key, value) for key, value in item.items())]) for item in content]
    lines, inner = [], []
    for key, value in content.items():
        listed = isinstance(value, list) and value and isinstance(value[0], dict)
        if listed or (isinstance(value, dict) and len(_inline(value)) > INLINE):
            inner += _section(f"{name}.{key}", value)
        else:
            lines.append(_line(key, value))
    own = ["\n".join([f"[{name}]", *lines])] if lines or not inner else []
    return own + inner


def _line(key: str, value: object) -> str:
    return f"{_key(key)} = {_inline(value)}"


def _inline(value: object) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(_line(key, item) for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return repr(value) if type(value) is float else _scalar(value)


@functools.lru_cache(maxsize=1024, typed=True)  # typed: 1, 1.0 and True are equal, but not the same text
def _scalar(value: object) -> str:
    return tomli_w.dumps({"x": value}).removeprefix("x = ").removesuffix("\n")


@functools.lru_cache(maxsize=1024)
def _key(key: str) -> str:
    return tomli_w.dumps({key: 0}).removesuffix(" = 0\n")


def value_of(text: str) -> Any:
    """Return the value of an assignment's right side: the TOML value if it is one, else the text itself."""
    try:
        value = read_toml(f"value = {text}")
    except ValueError:
        return text
    # a date is text here, and text with a second line is not a value
    return value["value"] if list(value) == ["value"] and _is_data(value["value"]) else text


def _is_data(value: object) -> bool:
    return isinstance(value, str | bool | int | float | list | dict)
