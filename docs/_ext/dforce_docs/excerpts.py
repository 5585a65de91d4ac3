"""Search results with excerpts where the pages are read from disk: a browser fetches no page from there.

The text of all pages goes into a script, which the search page loads when it is opened from disk, and only then.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

SCRIPT = "search-from-disk.js"
TEXTS = "texts.js"
MARKUP = re.compile(r"<(?!/?section\b)[^>]*>")  # all but the sections, whose anchors a result may name


def collect(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: nodes.document | None) -> None:
    """Keep the text of a page, and give the search page its script."""
    if page == "search":
        app.add_js_file(SCRIPT)
    elif doctree is not None:
        texts = app.env.__dict__.setdefault("dforce_texts", {})
        texts[page] = re.sub(r"\s+", " ", MARKUP.sub(" ", context["body"]))


def write(app: Sphinx, error: Exception | None) -> None:
    """Write the texts beside the pages."""
    if error is None and app.builder.format == "html":
        texts = json.dumps(app.env.__dict__.get("dforce_texts", {}), ensure_ascii=False)
        (Path(app.outdir) / "_static" / TEXTS).write_text(f"window.dforceTexts({texts})\n", encoding="utf-8")


def setup(app: Sphinx) -> None:
    """Collect while pages are written, write at the end."""
    app.connect("html-page-context", collect)
    app.connect("build-finished", write)
