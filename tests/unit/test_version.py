"""The version is written once; what repeats it agrees."""

import re
from pathlib import Path

from dforce._version import __version__

ROOT = Path(__file__).parents[2]


def test_citation_names_the_version_that_is_installed() -> None:
    cited = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    assert cited is not None
    assert cited[1] == __version__
