"""The directive `ran`: a block of commands or Python that is run while the pages are built, with its output.

All blocks of a page run in one folder of their own, in order, as a reader would type them. With the option `file` a block
is not run but written to that file, as a reader would save it. With `hidden` it is run and not shown: it asserts the
statements of the text. `exit` is the exit code that a command has to end with. `picture` with `caption` shows a picture that
the blocks have written. A block that fails, or warns, ends the build.
"""

from __future__ import annotations

import shutil
import warnings
from pathlib import Path
from typing import ClassVar

import matplotlib.pyplot as plt
from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

from ran_page import Page

PICTURES = "generated/pictures"
PAGES: dict[str, Page] = {}  # of the pages that are being read


class Ran(SphinxDirective):
    """A block that is run, and shown with its output."""

    has_content = True
    required_arguments = 1  # the language: sh or python; of a file any
    option_spec: ClassVar = {
        "exit": directives.nonnegative_int,
        "picture": directives.unchanged_required,
        "caption": directives.unchanged_required,
        "file": directives.unchanged_required,
        "hidden": directives.flag,
    }

    def run(self) -> list[nodes.Node]:
        """Run the block and return it, its output and its picture."""
        language, code = self.arguments[0], "\n".join(self.content)
        page = PAGES.setdefault(self.env.docname, Page())
        try:
            with warnings.catch_warnings(action="error"):
                output = page.run(language, code, self.options)
        except Exception as error:
            raise ExtensionError(f"{self.get_location()}: {type(error).__name__}: {error}") from error
        if "hidden" in self.options:
            return []
        box = nodes.container(classes=["ran"])
        if "file" in self.options:
            box = nodes.container("", literal_block=True, classes=["literal-block-wrapper"])
            box += nodes.caption("", "", nodes.literal(text=self.options["file"]))
        box += nodes.literal_block(code, code, language=language)
        if output.strip():
            shown = "\n".join(line.rstrip() for line in output.strip("\n").splitlines())
            box += nodes.literal_block(shown, shown, language="text")
        return [box, self._picture(page)] if "picture" in self.options else [box]

    def _picture(self, page: Page) -> nodes.figure:
        """Return a figure of a picture that the blocks have written."""
        made = page.folder / self.options["picture"]
        if not made.exists():
            raise ExtensionError(f"{self.get_location()}: no block has written {made.name}")
        target = Path(self.env.srcdir) / PICTURES / f"{self.env.docname.replace('/', '-')}-{made.name}"
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(made, target)
        caption, _ = self.parse_inline(self.options["caption"])
        uri = "/" + target.relative_to(self.env.srcdir).as_posix()
        figure = nodes.figure("", nodes.image(uri=uri, alt=self.options["caption"]))
        figure += nodes.caption("", "", *caption)
        return figure


def close(app: Sphinx, doctree: nodes.document) -> None:
    """Remove a page's folder once the page has been read."""
    page = PAGES.pop(app.env.docname, None)
    if page is not None:
        page.close()
        plt.close("all")


def setup(app: Sphinx) -> None:
    """Register the directive."""
    app.add_directive("ran", Ran)
    app.connect("doctree-read", close)
