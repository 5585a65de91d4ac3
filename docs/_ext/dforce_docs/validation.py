"""The page of the validation, written by the command that checks everything.

The quick part is run while the pages are built. To show the whole of it, name the page that ``dforce validate -o PAGE.md``
wrote in the environment variable DFORCE_VALIDATION.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from typer.testing import CliRunner

from dforce.cli.app import app as program

NOT_MET = 1  # the page then says which check is not met


def setup(app: Sphinx) -> None:
    """Write the page now, before the list of pages is made."""
    page, given = Path(app.srcdir) / "validation.md", os.environ.get("DFORCE_VALIDATION")
    if given:
        shutil.copyfile(given, page)
        return
    done = CliRunner().invoke(program, ["validate", "--quick", "--output", str(page)])
    if done.exit_code not in (0, NOT_MET):
        raise ExtensionError(f"dforce validate ended with {done.exit_code}: {done.output}")
