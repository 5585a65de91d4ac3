"""The version is written once, what repeats it agrees, and the package says of itself what is true."""

import importlib.metadata
import os
import re
import tomllib
from pathlib import Path

import pytest

from dforce._version import __version__

ROOT = Path(__file__).parents[2]


def test_citation_names_the_version_that_is_installed() -> None:
    cited = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    assert cited is not None
    assert cited[1] == __version__


def test_the_page_on_a_package_index_has_no_link_into_the_source() -> None:
    about = importlib.metadata.metadata("dforce")
    # a backport of importlib.metadata, once it is loaded, keeps the text among the headers
    text = str(about.get_payload() or about["Description"])
    assert "# dForce" in text and 'pip install "dforce[gui]"' in text and "```toml" in text
    targets = re.findall(r"\]\(([^)]*)\)", text)
    assert targets and all(target.startswith(("https://", "#")) for target in targets)
    assert about.get_all("Project-URL")


def test_the_source_archive_contains_every_folder_and_file_that_its_tests_use() -> None:
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    archived = tool["hatch"]["build"]["targets"]["sdist"]["include"]
    tests = "".join(file.read_text(encoding="utf-8") for file in sorted((ROOT / "tests").rglob("*.py")))
    used = re.findall(r'(?:ROOT|\.parents\[2\]) / "([^"]+)"', tests)
    assert "README.md" in used
    for name in (*tool["pytest"]["ini_options"]["pythonpath"], *used):
        assert "/" + name.partition("/")[0] in (*archived, "/pyproject.toml")  # which each archive contains


@pytest.mark.skipif(
    not os.environ.get("DFORCE_LOWEST"), reason="make test-lowest: the lowest versions are installed there"
)
def test_the_lowest_versions_are_those_that_are_tested() -> None:
    for wanted in importlib.metadata.requires("dforce") or ():
        found = re.match(r"([\w.-]+)(?:\[.*\])?(?:!=[\d.]+,)*>=([\d.]+)\s*(;.*extra.*)?$", wanted)
        if found is None or found[3]:
            continue
        installed = importlib.metadata.version(found[1])
        assert (installed + ".").startswith(found[2] + "."), f"{wanted} is tested with {installed}"
