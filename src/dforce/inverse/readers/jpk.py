"""Text that JPK's software writes: headings in comments of their own, and a block for each segment."""

from __future__ import annotations

import re
from collections.abc import Sequence

from dforce.inverse.readers.text import TextLine, beginning, read_text
from dforce.inverse.table import Reader

SIGNS = re.compile(r"^[#%]+ *(?:fancyNames *:|force-settings\.)", re.MULTILINE)


def _headings(above: Sequence[TextLine], width: int) -> list[str] | None:
    """Return the names in the comments, with their units."""
    found: dict[str, list[str]] = {}
    for line in above:
        key, colon, rest = line.text.partition(":")
        if line.comment and colon and key in ("columns", "fancyNames", "units") and key not in found:
            found[key] = re.findall(r'"([^"]*)"', rest) or rest.split()
    names = found.get("fancyNames", found.get("columns", []))
    if len(names) != width:
        return None
    units = found.get("units", [])
    return [f"{name} [{unit}]" for name, unit in zip(names, units, strict=True)] if len(units) == width else names


READER = Reader(
    kind="text",
    maker="JPK",
    endings=(".txt",),
    is_one=lambda content: SIGNS.search(beginning(content)) is not None,
    read=lambda content, name: read_text(content, name, _headings),
    names={"height": "height_piezo"},  # "Height (measured)" is the sensor
    notes={"k": "springConstant"},
    amplitude_by_version=True,
    not_read={
        b"PK\x03\x04": "is an archive; unpack it, or export a curve of JPK as text (ASCII), a sheet of Excel as CSV"
    },
    how="headings in comments, a block for each segment",
    seen="no: headings from published readers",
    export=(
        "**JPK (Data Processing).** Export the force curve as text with *Height (measured)*, lock-in amplitude and lock-in "
        "phase. `Height` alone is the command of the piezo. dForce asks for `amplitude_is`."
    ),
)
