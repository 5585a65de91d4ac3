"""Faults that pydantic finds in given values, one sentence each."""

from __future__ import annotations

import re
from typing import Any, get_args

import pydantic

from dforce.core.errors import ParameterError, nearest, shorten


def refusal(error: pydantic.ValidationError, model: type[pydantic.BaseModel], root: str = "") -> ParameterError:
    """Return the first problem that validation found, as an error with one sentence.

    It is a :class:`UnitError` where a quantity could not be read. `root` is the path of the model itself; empty for a whole
    case.
    """
    found = [(_path(model, item["loc"]), item) for item in error.errors(include_url=False)]
    start = found[0][0]
    # a value that fits no member of a union has one error for each member: the deepest error is used
    steps, first = max((f for f in found if f[0][: len(start)] == start), key=lambda f: len(f[0]))
    path = ".".join(part for part in (root, *steps) if part) or _title(model)
    if first["type"] == "value_error":
        inner = first["ctx"]["error"]
        text = str(inner)
        kind = type(inner) if isinstance(inner, ParameterError) else ParameterError
        if text.startswith(("= ", "is ", "has ", "takes ")):  # else it names its path by itself
            return kind(f"{path} {text}")
        return kind(text if isinstance(inner, ParameterError) else f"{path}: {text}")
    if first["type"] == "missing":
        field = _field(model, steps)
        meaning = f" ({field.description})" if field is not None and field.description else ""
        return ParameterError(f"{path}{meaning} is missing")
    text, field = f"{path} {_words(first)}", _field(model, steps)
    if first["type"] == "literal_error" and "did you mean" not in text and field is not None and field.description:
        text += f" ({field.description})"
    table = first["type"] == "tuple_type" and isinstance(first["input"], dict)
    return ParameterError(f"{text}{f'; write [[{path}]] in a file' if table else ''}")


def _words(problem: Any) -> str:
    """Return the problem of a value, as the end of a sentence that starts with its path."""
    kind, limits, given = problem["type"], problem.get("ctx", {}), shorten(problem.get("input"))
    if isinstance(problem.get("input"), str):
        given = f"'{given}'"
    if kind in ("literal_error", "enum"):
        hint = nearest(str(problem.get("input"))[:100], re.findall(r"'([^']*)'", limits["expected"]))
        return f"= {given} is not one of {limits['expected']}{hint if 'did you' in hint else ''}"
    said = {
        "greater_than": "is not above {gt}",
        "greater_than_equal": "is below {ge}",
        "less_than": "is not below {lt}",
        "less_than_equal": "is above {le}",
        "int_type": "is not a whole number",
        "int_from_float": "is not a whole number",
        "int_parsing": "is not a whole number",
        "int_parsing_size": "is not a whole number of a reasonable size",
        "finite_number": "is not a finite number",
        "float_type": "is not a number",
        "float_parsing": "is not a number",
        "bool_type": "is neither true nor false",
        "bool_parsing": "is neither true nor false",
        "string_type": "is not text",
        "string_too_long": "is longer than {max_length} characters",
        "tuple_type": "is not a list",
        "model_type": "is not a table of parameters",
        "recursion_loop": "contains itself",
    }.get(kind)
    if said is None:
        return f"= {given}: {problem['msg'][0].lower()}{problem['msg'][1:]}"
    return f"= {given} {said.format(**limits)}"


def _title(model: type[pydantic.BaseModel]) -> str:
    section = getattr(model, "section", None)  # of a table of parameters
    return str(section() if section is not None else model.__name__.lower())


def _models(annotation: object) -> list[type[pydantic.BaseModel]]:
    """Return the models that a field's annotation mentions."""
    if isinstance(annotation, type) and issubclass(annotation, pydantic.BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models(part)]


def _path(model: type[pydantic.BaseModel], loc: tuple[int | str, ...]) -> tuple[str, ...]:
    """Return the steps that a user typed; pydantic adds the tags of unions and the names of validators."""
    steps: list[str] = []
    known = [model]
    for step in loc:
        if isinstance(step, int):
            steps.append(str(step + 1))  # people count modes, tones and forces from 1
            continue
        field = next((m.model_fields[step] for m in known if step in m.model_fields), None)
        if field is not None:
            steps.append(step)
            known = _models(field.annotation)
    return tuple(steps)


def _field(model: type[pydantic.BaseModel], steps: tuple[str, ...]) -> Any:
    field, known = None, [model]
    for step in steps:
        if step.isdigit():
            continue
        field = next((m.model_fields[step] for m in known if step in m.model_fields), None)
        known = _models(field.annotation) if field is not None else []
    return field
