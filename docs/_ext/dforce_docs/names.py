"""Long names in tables may break behind an underscore, a dot or a slash, and nowhere else."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.transforms.post_transforms import SphinxPostTransform

PIECES = re.compile(r"(?<=\w[_./])(?=[^\W\d])")  # never into a number


class BreakNames(SphinxPostTransform):
    """Puts a place for a line break into names in cells."""

    default_priority = 900
    formats = ("html",)

    def run(self, **kwargs: Any) -> None:
        """Go through all tables."""
        for cell in self.document.findall(nodes.entry):
            for name in list(cell.findall(nodes.literal)):
                first, *others = PIECES.split(name.astext())
                name.clear()
                name += nodes.Text(first)
                for piece in others:
                    name += [nodes.raw("", "<wbr>", format="html"), nodes.Text(piece)]


def setup(app: Sphinx) -> None:
    """Register the transform."""
    app.add_post_transform(BreakNames)
