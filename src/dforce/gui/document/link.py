"""A document as the end of an address: what is typed, sliders, pictures and set point, small enough for a link."""

from __future__ import annotations

import base64
import binascii
import dataclasses
import json
import zlib

import dforce as df
from dforce.gui.document.document import Document

LONGEST = 20_000  # characters of a link; a case of some forces has about 1000
LARGEST = 1_000_000  # bytes that a link may unpack to
KEPT = ("results", "measured", "aside")  # of which a link says nothing: they are files, or what was typed before


def to_link(document: Document) -> str:
    """Return the text of a document for an address; results and measured curves are not in it."""
    plain = dataclasses.replace(document, results=(), measured=None, aside={}).to_plain()
    if plain["opened"] == plain["table"]:
        plain["opened"] = None
    packed = zlib.compress(json.dumps(plain, separators=(",", ":")).encode(), 9)
    return base64.urlsafe_b64encode(packed).decode("ascii").rstrip("=")


def from_link(text: str, beside: Document) -> Document:
    """Return the document of a link, with the results and the measured curve of another one.

    Raises
    ------
    CaseError
        When the text contains no document.
    """
    try:
        if len(text) > LONGEST:
            raise ValueError("a link that is too long")
        unpacking = zlib.decompressobj()
        packed = base64.urlsafe_b64decode(text + "=" * (-len(text) % 4))
        plain = json.loads(unpacking.decompress(packed, LARGEST))
        if not isinstance(plain, dict):
            raise TypeError("no document")
        if plain.get("opened") is None:
            plain["opened"] = plain["table"]
        found = Document.from_plain(plain | {"results": (), "measured": None})
    except (binascii.Error, zlib.error, ValueError, TypeError, KeyError, RecursionError, df.CaseError):
        raise df.CaseError("this link contains no case; copy the whole address") from None
    return dataclasses.replace(found, **{name: getattr(beside, name) for name in KEPT})
