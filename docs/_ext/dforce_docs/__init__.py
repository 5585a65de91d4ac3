"""Pages and tables of the documentation that are made from dForce's own declarations."""

from __future__ import annotations

from typing import Any

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

from dforce_docs import (
    cases,
    cli,
    commands,
    costs,
    excerpts,
    forces,
    mathml,
    misprints,
    names,
    offline,
    public_names,
    quantities,
    readers,
    validation,
)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register everything with Sphinx."""
    parts = (
        mathml,
        commands,
        forces,
        quantities,
        cases,
        cli,
        costs,
        excerpts,
        misprints,
        names,
        offline,
        public_names,
        readers,
        validation,
    )
    for part in parts:
        part.setup(app)
    app.connect("env-before-read-docs", start_last)
    return {"parallel_read_safe": False, "parallel_write_safe": True}


def start_last(app: Sphinx, env: BuildEnvironment, pages: list[str]) -> None:
    """Read the start page last: its cards show pictures that other pages draw."""
    pages.sort(key=lambda page: page == "index")
