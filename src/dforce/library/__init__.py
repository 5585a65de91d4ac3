"""The library: examples and media as data, one file each, with their sources.

This module only reads text; :mod:`dforce.case` and :mod:`dforce.instrument` interpret it.
"""

from __future__ import annotations

import functools
import tomllib
from dataclasses import dataclass, field
from importlib import resources
from typing import Any

from dforce.core.errors import Catalog
from dforce.core.listing import Shown, html_table, paragraphs

# folders of the examples, in the order in which they are listed: a question each, and the paper
FOLDERS = {
    "states": "Two states and jumps",
    "safe": "Safe settings",
    "frequency": "Frequency contrast",
    "paper": "Figures and tables of the 2015 paper",
}


@dataclass(frozen=True)
class Example:
    """A case that is shipped, as text, with its folder and its words."""

    name: str
    folder: str
    title: str
    source: str
    shows: str
    unsaid: str
    text: str = field(repr=False)


class Examples(Shown, Catalog[Example]):
    """The result of :func:`examples`: a dict by name, shown as a table."""

    kind = "example"
    listed_by = "dforce examples"

    def as_text(self) -> str:
        """Return name, title and purpose of each case."""
        return paragraphs((f"{one.name}: {one.title}", one.shows) for one in self.values())

    def as_html(self) -> str:
        """Return a row for each case."""
        return html_table([(one.name, one.title, one.shows) for one in self.values()], ("name", "title", "shows"))


@functools.cache
def examples() -> Examples:
    """Return the shipped cases by name, folder by folder; a notebook draws the dict as a table."""
    found = Examples()
    for folder in FOLDERS:
        files = (resources.files(__package__) / "examples" / folder).iterdir()
        for file in sorted(files, key=lambda file: file.name):
            if file.name.endswith(".toml"):
                text = file.read_text(encoding="utf-8")
                content = tomllib.loads(text)
                name = file.name.removesuffix(".toml")
                found[name] = Example(name, folder, content["title"], **content["about"], text=text)
    return found


def measured_data() -> dict[str, bytes]:
    """Return the shipped measured files, and the cases that fit them, by name."""
    return {file.name: file.read_bytes() for file in (resources.files(__package__) / "measured").iterdir()}


def example_text(name: str) -> str:
    """Return the TOML text of a shipped case.

    Raises
    ------
    ParameterError
        When there is no example of this name; the sentence holds the nearest one.
    """
    return examples()[name].text


@functools.cache
def media() -> dict[str, dict[str, Any]]:
    """Return density, viscosity, permittivity and source of each known medium, as text with units."""
    text = (resources.files(__package__) / "media.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)
