"""The directive `misprints`: the paper's misprints, computed while the pages are built."""

from __future__ import annotations

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from misprint_proofs import misprints_text


class Misprints(SphinxDirective):
    """All of them, one below the other."""

    def run(self) -> list[nodes.Node]:
        """Compute the text and return it."""
        return self.parse_text_to_nodes(misprints_text())


def setup(app: Sphinx) -> None:
    """Register the directive."""
    app.add_directive("misprints", Misprints)
