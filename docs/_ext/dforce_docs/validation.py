"""The page of the validation, from ``make validate``; a build makes it anew only on request.

DFORCE_VALIDATION=run runs the quick part while the pages are built, DFORCE_VALIDATION=PAGE.md takes another file. The page
names the version of dForce that wrote it; beside pages of another version a warning says so.
"""

from __future__ import annotations

import os
import re
import tempfile
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app as program

NOT_MET = 1  # the page then says which check is not met
WRITTEN = Path(__file__).parents[3] / "validation.md"  # by `make validate`
VERSION = re.compile(r"\bdforce ([\w.+]+)")

MISSING = """\
# Validation

dForce compares its results with published equations, exact balances and independent integrators. This copy of the pages was
built without the results. `make validate` computes all of them and writes `validation.md`, in about an hour on two cores;
then `make docs` shows that file here. On your machine:

```shell
dforce validate --quick -o validation.md   # the quick part, in some minutes
```
"""


def text(given: str) -> str:
    """Return the page of a file, or of a quick validation that is run now where `given` is `run`."""
    if given == "run":
        with tempfile.TemporaryDirectory() as folder:
            page = Path(folder, "validation.md")
            done = CliRunner().invoke(program, ["validate", "--quick", "--output", str(page)])
            if done.exit_code not in (0, NOT_MET):
                raise ExtensionError(f"dforce validate ended with {done.exit_code}: {done.output}")
            return page.read_text(encoding="utf-8")
    path = Path(given) if given else WRITTEN
    return with_version(path.read_text(encoding="utf-8")) if path.exists() else MISSING


def with_version(page: str) -> str:
    """Return the page with a warning below its title where another version of dForce wrote it."""
    found = VERSION.search(page)
    wrote = found[1] if found else "an unknown version"
    if wrote == df.__version__:
        return page
    title, rest = page.split("\n", 1)
    return f"{title}\n\n:::{{warning}}\ndForce {wrote} wrote this page. The other pages describe {df.__version__}.\n:::\n{rest}"


def setup(app: Sphinx) -> None:
    """Write the page now, before the list of pages is made."""
    (Path(app.srcdir) / "validation.md").write_text(text(os.environ.get("DFORCE_VALIDATION", "")), encoding="utf-8")
