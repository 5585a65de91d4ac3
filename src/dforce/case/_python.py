"""A case as the text of a Python script that runs it."""

from __future__ import annotations

import json
from collections.abc import Iterable

from dforce import forces, instrument
from dforce.case._text import tables
from dforce.core import units
from dforce.core.parameter_quantity import ParameterQuantity
from dforce.core.parameters import Parameters
from dforce.experiments import Experiment
from dforce.forces import Force

WIDTH = 100  # characters of a line, where a text is not longer by itself
HEAD = "import dforce as df\n\n"
TAIL = """
result = df.{run}(case, progress=True)
df.write(result, {result})
df.plot.save(df.plot.overview(result), {picture})
"""


def script_of(case: Parameters, name: str) -> str:
    """Return a script that builds a case, runs it, and writes result and picture to files of this name."""
    run = "run" if getattr(case, "sweep", None) is None else "sweep"
    return f"{HEAD}case = {_object(case, '')}\n" + TAIL.format(
        run=run, result=json.dumps(f"{name}.nc"), picture=json.dumps(f"{name}.png")
    )


def _object(given: Parameters, indent: str) -> str:
    """Return the call that builds an object with its set values."""
    quantities = given.quantities()
    parts = []
    for key in given.keys():  # noqa: SIM118 the method of Parameters
        value = getattr(given, key)
        if key in given.model_fields_set and value is not None and key not in _implied(given):
            parts.append((f"{key}=", value, quantities.get(key)))
    return _call(f"{_class(given)}(", parts, ")", indent)


def _implied(given: Parameters) -> tuple[str, ...]:
    return ("kind",) if isinstance(given, Experiment) else ()


def _class(given: Parameters) -> str:
    """Return where a script finds a class: forces and experiments have modules of their own."""
    name, module = type(given).__name__, type(given).__module__
    if isinstance(given, Force):
        return f"df.forces.{name}"
    return f"df.experiments.{name}" if module.startswith("dforce.experiments.") else f"df.{name}"


def _call(start: str, parts: Iterable[tuple[str, object, ParameterQuantity | None]], end: str, indent: str) -> str:
    """Return a call or a list on one line where it fits, else with a line for each part."""
    inner = indent + "    "
    texts = [key + _value(value, quantity, inner) for key, value, quantity in parts]
    line = f"{start}{', '.join(texts)}{end}"
    if len(indent) + len(line) <= WIDTH and "\n" not in line:
        return line
    return start + "".join(f"\n{inner}{text}," for text in texts) + f"\n{indent}{end}"


def _value(value: object, quantity: ParameterQuantity | None, indent: str) -> str:
    if isinstance(value, Force) and getattr(forces, type(value).__name__, None) is not type(value):
        return repr(tables(value, shown=True))  # of a file of one's own, which the case loads
    if (
        isinstance(value, Parameters)
        and type(value).__module__.startswith(("dforce.case.", "dforce.instrument."))
        and (type(value).__name__ not in instrument.__all__)
    ):
        return _value(tables(value, shown=True), None, indent)  # sections without a public class
    if isinstance(value, Parameters):
        return _object(value, indent)
    if isinstance(value, dict):
        return _call("{", [(f"{json.dumps(key)}: ", item, quantity) for key, item in value.items()], "}", indent)
    if isinstance(value, tuple | list):
        return _call("[", [("", item, quantity) for item in value], "]", indent)
    if isinstance(value, float) and quantity is not None and quantity.unit != "1":
        value = units.show(float(value), quantity.unit)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)  # a text of Python, too, in its usual quotes
    return repr(float(value) if isinstance(value, float) else value)
