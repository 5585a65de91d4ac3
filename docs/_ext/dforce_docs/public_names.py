"""Every public name stands on the page of the Python reference: one that is missing ends the build."""

from __future__ import annotations

import re
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

import dforce as df


def check_names(app: Sphinx) -> None:
    """Look for each public name on the page.

    Raises
    ------
    ExtensionError
        When some are missing.
    """
    page = (Path(app.srcdir) / "reference" / "api.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"^   (\w+)$", page, re.MULTILINE))
    missing = [name for name in dir(df) if name not in listed and callable(getattr(df, name))]
    if missing:
        raise ExtensionError(f"docs/reference/api.md does not list {', '.join(missing)}")


def setup(app: Sphinx) -> None:
    """Check once, before anything is built."""
    check_names(app)
