"""The directive `readers`: the files of measured curves, and how to export them, from the readers themselves."""

from __future__ import annotations

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from dforce.inverse.readers import sorted_readers
from dforce.inverse.table import Reader
from dforce_docs.declared import list_table

HEADER = ("file", "endings", "how", "larger heights are", "seen on a file of an instrument")
UNKNOWN = "as the curve shows, or asked for"


class Readers(SphinxDirective):
    """A table of the readers (`table`), or a paragraph for each maker on its export (`exports`)."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the table, or the paragraphs."""
        if self.arguments == ["exports"]:
            return self.parse_text_to_nodes("\n\n".join(one.export for one in sorted_readers() if one.export))
        rows = [_row(one) for one in sorted_readers()]
        return self.parse_text_to_nodes(f"```{{eval-rst}}\n{list_table(HEADER, rows)}\n```")


def _row(one: Reader) -> tuple[str, ...]:
    endings = ", ".join(f"`{ending}`" for ending in one.endings)
    grows = " or ".join(sorted(set(one.height_grows.values()))) or UNKNOWN
    return str(one), endings, one.how, grows, one.seen


def setup(app: Sphinx) -> None:
    """Register the directive."""
    app.add_directive("readers", Readers)
