"""Ends the build where a page would load something from a network; links that a reader may click are no harm."""

from __future__ import annotations

import re
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

LOADED = re.compile(
    r"""<(?:script|img|iframe|source|embed|object)\b[^>]*\b(?:src|srcset|data)=["'](?:https?:)?//[^"']*"""
    r"""|<link\b(?=[^>]*\brel=["'](?:stylesheet|preload|icon|modulepreload))[^>]*\bhref=["'](?:https?:)?//[^"']*"""
)
IN_STYLES = re.compile(r"""(?:url\(\s*["']?|@import\s+["'])(?:https?:)?//[^"')]*""")


def check(app: Sphinx, error: Exception | None) -> None:
    """Look through all pages and styles."""
    if error is not None or app.builder.format != "html":
        return
    out = Path(app.outdir)
    for ending, pattern in (("*.html", LOADED), ("*.css", IN_STYLES)):
        for path in sorted(out.rglob(ending)):
            found = pattern.search(path.read_text(encoding="utf-8"))
            if found:
                raise ExtensionError(f"{path.relative_to(out)} loads from a network: {found[0]}")


def setup(app: Sphinx) -> None:
    """Check when all is written."""
    app.connect("build-finished", check)
