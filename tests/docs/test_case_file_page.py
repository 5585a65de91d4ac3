"""The page of a case file shows each table that a case may have, with its keys."""

import re
import sys
from pathlib import Path

import pytest

import dforce as df

pytest.importorskip("sphinx", reason="comes with the extra docs")
sys.path.insert(0, str(Path(__file__).parents[2] / "docs" / "_ext"))
from dforce_docs import cases


def test_each_key_of_each_table_is_on_the_page():
    sections = [set(re.findall(r"``(\w+)``", part)) for part in cases.text().split("list-table::")]
    tables = {name: table.get("properties", {}) for name, table in df.case.case_schema()["$defs"].items()}
    missing = {
        name
        for name, keys in tables.items()
        if not name.startswith("forces.") and not any(keys.keys() - {"kind"} <= shown for shown in sections)
    }
    assert missing == set()


def test_a_number_beside_a_word_keeps_its_bounds():
    assert "``peak``, or > 0 Hz" in cases.text()
