"""The page of the public names that the pages of the reference do not list: what forms and other programs use."""

from __future__ import annotations

import re
from pathlib import Path

from sphinx.application import Sphinx

import dforce as df

INTRODUCTION = """\
For other programs
==================

What ``dforce`` exports beside the names for experiments: the command line and the window are made with it, and so may be
a form or a program of yours.

.. currentmodule:: dforce
.. autosummary::
   :toctree: generated
   :nosignatures:

"""


def write_page(app: Sphinx) -> None:
    """Write the page into the folder of the reference."""
    folder = Path(app.srcdir) / "reference"
    listed = set(re.findall(r"^   (\w+)$", (folder / "api.md").read_text(encoding="utf-8"), re.MULTILINE))
    rest = [name for name in df.__all__ if name not in listed and callable(getattr(df, name))]
    (folder / "others.rst").write_text(INTRODUCTION + "".join(f"   {name}\n" for name in rest), encoding="utf-8")


def setup(app: Sphinx) -> None:
    """Write the page now: autosummary reads the list of pages that is made next."""
    write_page(app)
