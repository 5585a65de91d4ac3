"""TOML text of strangers as tables; every case, plan and project is read here.

The time that tomllib takes grows with the square of a key's parts: minutes for `a.a.a. ...` of some kilobytes. A key here has
no more parts than a path in a case could have.
"""

from __future__ import annotations

import re
import tomllib
from typing import Any

from dforce.core.errors import shorten

REMEDY = 'write numbers as 5.0, units as "10 nm" in plain quotes, and each name once'
LONGEST = 1_000_000  # characters; a longer text is no case
MOST_PARTS = 12  # of a key
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
DEEP_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MOST_PARTS}}}")


def read_toml(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text.

    Raises
    ------
    ValueError
        With a sentence, where it is none, too long, or nested too deeply.
    """
    if len(text) > LONGEST:
        raise ValueError(f"it has {len(text)} characters; the limit is {LONGEST}")
    if (found := DEEP_KEY.search(text)) is not None:
        line = text.count("\n", 0, found.start()) + 1
        raise ValueError(f"line {line} has a key of more than {MOST_PARTS} parts")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        lines, place = text.split("\n"), re.search(r"line (\d+)", str(error))
        shown = f" in '{shorten(lines[int(place[1]) - 1].strip(), 40)}'" if place else ""
        raise ValueError(f"{error}{shown}; {REMEDY}") from None
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
