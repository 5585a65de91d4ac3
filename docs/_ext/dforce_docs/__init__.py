"""Pages and tables of the documentation that are made from dForce's own declarations."""

from __future__ import annotations

from typing import Any

from sphinx.application import Sphinx

from dforce_docs import (
    cases,
    cli,
    commands,
    costs,
    forces,
    mathml,
    misprints,
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
        misprints,
        offline,
        public_names,
        readers,
        validation,
    )
    for part in parts:
        part.setup(app)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
