"""The state of a page in its address: what a link holds, and what it may not."""

from __future__ import annotations

import base64
import dataclasses
import json
import zlib

import pytest

import dforce as df
from dforce.gui.document.document import Document, KeptResult, Slider
from dforce.gui.window.address import from_link, to_link


@pytest.mark.parametrize("name", sorted(df.examples()))
def test_a_link_gives_the_document_again(name):
    document = Document.of(df.example(name)).put(("drive", "A0"), "17.3 nm").switch(0, on=False)
    document = dataclasses.replace(document, set_point=0.62, sliders=(Slider(("drive", "A0"), 5.0, 30.0),))
    text = to_link(document)
    assert len(text) < 4000  # fits into an address anywhere
    assert from_link(text, Document.first()) == document


def test_a_link_leaves_results_as_they_are():
    kept = (KeptResult("abc", "first", 0),)
    mine = dataclasses.replace(Document.first(), results=kept)
    assert from_link(to_link(Document.of(df.example("figure-3-air"))), mine).results == kept
    assert "abc" not in zlib.decompress(base64.urlsafe_b64decode(to_link(mine) + "===")).decode()


def packed(plain):
    return base64.urlsafe_b64encode(zlib.compress(json.dumps(plain).encode())).decode()


@pytest.mark.parametrize(
    "text",
    [
        "",
        "%%%",
        "abc",
        packed([1]),
        packed({"table": 3}),
        packed("[" * 50),
        packed({"table": {"a": "x" * 2_000_000}}),
        "A" * 30_000,
    ],
)
def test_a_text_that_is_no_link_is_refused_in_a_sentence(text):
    with pytest.raises(df.CaseError, match="contains no case"):
        from_link(text, Document.first())
