"""Equations as MathML, which browsers draw themselves: no script, no network.

The font with stretching brackets comes from the package ziamath: a browser on Linux may have none.
"""

from __future__ import annotations

import importlib.resources
import re
import shutil
from pathlib import Path

from docutils import nodes
from math_core import LatexError, LatexToMathML
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.math import get_node_equation_number
from sphinx.writers.html5 import HTML5Translator

FONT = "STIXTwoMath-Regular.ttf"
ROW_SPACE = re.compile(r"\\\\\[[^]]*\]")
CONVERTER = LatexToMathML(fancy_error=False)


def convert(latex: str, display: bool) -> str:
    """Return an equation as MathML; one that cannot be read ends the build."""
    try:
        text = CONVERTER.convert_with_local_state(ROW_SPACE.sub(r"\\\\", latex), displaystyle=display)
    except LatexError as error:
        raise ExtensionError(f"the equation {latex} cannot be read: {error}") from error
    return text.replace(' accent="true"', "")  # Chromium draws such a bar or dot into its letter


def visit_inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write an equation within a line."""
    translator.body.append(convert(node.astext(), display=False))
    raise nodes.SkipNode


def visit_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write an equation on lines of its own."""
    translator.body.append(translator.starttag(node, "div", CLASS="math-block"))
    translator.body.append(convert(node.astext(), display=True))
    if node.get("number"):
        translator.body.append(f'<span class="eqno">({get_node_equation_number(translator, node)})</span>')
    translator.body.append("</div>\n")
    raise nodes.SkipNode


def ship_font(app: Sphinx, error: Exception | None) -> None:
    """Copy the font beside the pages."""
    if error is None and app.builder.format == "html":
        font = importlib.resources.files("ziamath") / "fonts" / FONT
        with importlib.resources.as_file(font) as path:
            shutil.copyfile(path, Path(app.outdir) / "_static" / FONT)


def setup(app: Sphinx) -> None:
    """Register the way to write equations."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    app.connect("build-finished", ship_font)
