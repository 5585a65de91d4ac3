"""The page of all keys of a case file, from the declarations."""

from __future__ import annotations

import inspect
from pathlib import Path

import pydantic
from sphinx.application import Sphinx

import dforce as df
from dforce.case import About, Range, Sweep
from dforce.core.parameters import Parameters
from dforce.experiments import EXPERIMENTS, AmplitudeGrid, DeflectionGrid, PhaseGrid, VelocityGrid
from dforce_docs.declared import list_table, parameter_table

INTRODUCTION = """\
Keys of a case file
===================

A case is a TOML file. Every key is checked. An unknown key, a wrong unit or a value beyond its bounds ends in one sentence
with the key and its allowed values. A number is in SI; text carries its unit (``"48.9 kHz"``). The same names are arguments in
Python. For ``--set`` and ``Case.replace`` join them by dots: ``drive.A0``, ``forces.dmt.hamaker``, ``cantilever.modes.2.Q``
(counted from 1). ``dforce schema`` prints a JSON schema, for editors that complete and check a case file.
"""

SECTIONS: tuple[tuple[str, type[Parameters]], ...] = (
    ("[cantilever]", df.Cantilever),
    ("[[cantilever.modes]]", df.Mode),
    ("[cantilever.beam]", df.Beam),
    ("[drive]", df.Drive),
    ("[[drive.tones]]", df.Tone),
    ("[tip]", df.Tip),
    ("[sample]", df.Sample),
    ("[contact]", df.Contact),
    ("[medium]", df.Medium),
)
INNER: tuple[tuple[str, type[Parameters]], ...] = (
    ("zc = { ... }, a grid of distances", df.experiments.Grid),
    ("zc = { ... }, distances as shares of A0", df.experiments.RelativeGrid),
    ("zc = { ... }, a range of distances", df.experiments.Span),
    ("frequency = { ... }", df.experiments.FrequencyGrid),
    ("start = { ... }", df.experiments.InitialMotion),
    ("amplitude = { ... }", AmplitudeGrid),
    ("phase = { ... }", PhaseGrid),
    ("deflection = { ... }", DeflectionGrid),
    ("velocity = { ... }", VelocityGrid),
)


def _section(title: str, model: type[Parameters], mark: str, skip: tuple[str, ...] = ()) -> str:
    about = inspect.cleandoc(model.__doc__ or "")
    names = model.keys()
    keys = [key for key in names if key not in skip]
    return f"{title}\n{mark * len(title)}\n\n{about}\n\n{parameter_table(model, keys)}"


def _top() -> str:
    """Return the keys that stand outside all sections."""
    texts = {"title": df.Case, "plugins": df.Case}
    rows = [(f"``{key}``", _about(model, key)) for key, model in texts.items()]
    return "Top of the file\n---------------\n\n" + list_table(("key", "meaning"), rows)


def _about(model: type[pydantic.BaseModel], key: str) -> str:
    return model.model_fields[key].description or ""


def text() -> str:
    """Return the page in reStructuredText."""
    parts = [INTRODUCTION, _top(), _section("[about]", About, "-")]
    parts += [_section(title, model, "-") for title, model in SECTIONS]
    parts.append(
        "[[forces]]\n----------\n\n``model`` names the law; the other keys are its parameters. Each model has "
        "a page with its keys: :doc:`/forces/index`.\n"
    )
    parts.append("[experiment]\n------------\n\n``kind`` sets the experiment; the other keys depend on it.\n")
    for kind, model in EXPERIMENTS.items():
        parts.append(_section(f'kind = "{kind}"', model, "~", skip=("kind",)))
    parts += [_section(title, model, "~") for title, model in INNER]
    parts.append(_section("[solver]", df.SolverSettings, "-"))
    parts.append(_section("[sweep]", Sweep, "-"))
    parts.append(_section("over.PATH = { ... }, a range of values", Range, "~"))
    return "\n\n".join(parts)


def write_page(app: Sphinx) -> None:
    """Write the page into the folder of the reference."""
    (Path(app.srcdir) / "reference" / "case-file.rst").write_text(text(), encoding="utf-8")


def setup(app: Sphinx) -> None:
    """Write the page before any page is read."""
    app.connect("builder-inited", write_page)
