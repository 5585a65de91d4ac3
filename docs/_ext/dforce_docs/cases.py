"""The page of all keys of a case file, from the declarations."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args, get_origin

from sphinx.application import Sphinx

import dforce as df
from dforce.core.parameters import Parameters
from dforce.experiments import EXPERIMENTS, Experiment
from dforce.inverse.plan_file import KEYS
from dforce_docs.declared import list_table, parameter_table

INTRODUCTION = """\
Keys of a case file
===================

A case is a TOML file. Every key is checked. An unknown key, a wrong unit or a value beyond its bounds ends in one sentence
with the key and its allowed values. A number is in SI; text carries its unit (``"48.9 kHz"``). The same names are arguments in
Python. For ``--set`` and ``Case.replace`` join them by dots: ``drive.A0``, ``forces.dmt.hamaker``, ``cantilever.modes.2.Q``
(counted from 1). ``dforce schema`` prints a JSON schema, for editors that complete and check a case file.
"""

BELOW = {tuple: "[[{}]]", dict: '[{}."PATH"]'}  # how a file writes tables in a list, and tables by path
FORCES = """\
[[forces]]
----------

``model`` names the law; the other keys are its parameters. Each model has a page with its keys: :doc:`/forces/index`.
"""
PLAN = f"""\
[plan]
------

A plan file has one more table, with the keys {", ".join(f"``{key}``" for key in KEYS)}: :doc:`/planning`.
"""


def tables(model: type[Parameters], path: str = "") -> Iterator[tuple[str, type[Parameters]]]:
    """Give each table below a model, with its heading in a file, at any depth."""
    for key, field in model.model_fields.items():
        for heading, inner in _models(field.annotation, "[{}]"):
            yield heading.format(path + key), inner
            yield from tables(inner, f"{path}{key}.")


def _models(annotation: Any, heading: str) -> Iterator[tuple[str, type[Parameters]]]:
    if isinstance(annotation, type) and issubclass(annotation, Parameters):
        yield heading, annotation
    heading = BELOW.get(get_origin(annotation), heading)
    for part in get_args(annotation):
        yield from _models(part, heading)


def _section(title: str, model: type[Parameters], mark: str, skip: tuple[str, ...] = ()) -> str:
    about = inspect.cleandoc(model.__doc__ or "")
    names = model.keys()
    keys = [key for key in names if key not in skip]
    return f"{title}\n{mark * len(title)}\n\n{about}\n\n{parameter_table(model, keys)}"


def _top() -> str:
    """Return the keys outside all sections."""
    rows = [(f"``{key}``", df.Case.model_fields[key].description or "") for key in ("title", "plugins")]
    return "Top of the file\n---------------\n\n" + list_table(("key", "meaning"), rows)


def _experiments() -> Iterator[str]:
    """Give the section of each experiment, and after them each table that some of them have."""
    yield "[experiment]\n------------\n\n``kind`` sets the experiment; the other keys depend on it.\n"
    shared: dict[type[Parameters], str] = {}
    for kind, model in EXPERIMENTS.items():
        yield _section(f'kind = "{kind}"', model, "~", skip=("kind",))
        shared |= {inner: f"{heading.strip('[]')} = {{ ... }} ({inner.__name__})" for heading, inner in tables(model)}
    for model, title in shared.items():
        yield _section(title, model, "~")


def text() -> str:
    """Return the page in reStructuredText."""
    parts = [INTRODUCTION, _top()]
    for heading, model in tables(df.Case):
        if issubclass(model, df.Force):
            parts.append(FORCES)
        elif issubclass(model, Experiment):
            parts += _experiments()
        else:
            parts.append(_section(heading, model, "~" if "." in heading else "-"))
    return "\n\n".join([*parts, PLAN])


def write_page(app: Sphinx) -> None:
    """Write the page into the folder of the reference."""
    (Path(app.srcdir) / "reference" / "case-file.rst").write_text(text(), encoding="utf-8")


def setup(app: Sphinx) -> None:
    """Write the page before any page is read."""
    app.connect("builder-inited", write_page)
