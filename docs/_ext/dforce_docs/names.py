"""Long names in tables may go on in the next line behind an underscore, a dot or a slash, and nowhere else."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.transforms.post_transforms import SphinxPostTransform

PIECES = re.compile(r"(?<=\w[_./])(?=\w)")


class BreakNames(SphinxPostTransform):
    """Puts a place for a line break into names in cells."""

    default_priority = 900
    formats = ("html",)

    def run(self, **kwargs: Any) -> None:
        """Go through all tables."""
        for cell in self.document.findall(nodes.entry):
            for text in list(cell.findall(nodes.Text)):
                pieces = PIECES.split(text.astext()) if text.parent.parent is not None else []
                if len(pieces) < 2 or isinstance(text.parent, nodes.math | nodes.raw):
                    continue
                new: list[nodes.Node] = [nodes.Text(pieces[0])]
                for piece in pieces[1:]:
                    new += [nodes.raw("", "<wbr>", format="html"), nodes.Text(piece)]
                text.parent.replace(text, new)


def setup(app: Sphinx) -> None:
    """Register the transform."""
    app.add_post_transform(BreakNames)
