"""The address of a page: a link has the case, sliders, pictures and set point, so that it opens the case again."""

from __future__ import annotations

import asyncio
import base64
import binascii
import dataclasses
import json
import zlib
from pathlib import Path

from nicegui import ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.gui.document.document import Document
from dforce.gui.window.dialogs import as_sentence, say
from dforce.gui.window.view import View

LONGEST = 20_000  # characters of a link; a case of some forces has about 1000
LARGEST = 1_000_000  # bytes that a link may unpack to
KEPT = ("results", "measured", "aside")  # not in a link: they are files, or earlier input


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


AFTER = 0.6  # s without a change after which the address follows
SCRIPT = Path(__file__).parent / "address.js"


class Address:
    """Keeps the address of one page in step with its document, and opens a link that is followed."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.client = ui.context.client
        self._later: asyncio.TimerHandle | None = None
        self._there = ""
        self._is_gone = False
        ui.add_body_html(f"<script>{SCRIPT.read_text(encoding='utf-8')}</script>")
        ui.on("dforce-link", self._followed)
        view.on_show.append(lambda anew: self._soon())
        view.on_anew.append(self._soon)

    async def begin(self) -> None:
        """Open the link by which the page was reached, if any."""
        try:
            link = await ui.run_javascript("return dforceAddress.first()", timeout=60.0)
        except TimeoutError:
            return
        self._open(str(link or ""))
        self._soon()

    def end(self) -> None:
        """Follow no more: the page is gone."""
        self._is_gone = True
        if self._later is not None:
            self._later.cancel()
            self._later = None

    def _followed(self, event: GenericEventArguments) -> None:
        self._open(str(event.args or ""))

    def _open(self, link: str) -> None:
        text = link.removeprefix("#")
        if not text or text == self._there or text == to_link(self.view.document):
            return
        try:
            document = from_link(text, self.view.document)
        except df.CaseError as error:
            say(as_sentence(str(error)))
            return
        plots, set_point = document.plots, document.set_point
        self.view.open(document)
        self.view.session.look(dataclasses.replace(self.view.document, plots=plots, set_point=set_point))

    def _soon(self) -> None:
        if self._later is not None:
            self._later.cancel()
        if self._is_gone:
            return
        self._later = asyncio.get_running_loop().call_later(AFTER, self._show)

    def _show(self) -> None:
        self._later = None
        text = to_link(self.view.document)
        if text == self._there:
            return
        self._there = text
        self.client.run_javascript(f"dforceAddress.show({json.dumps(text)})")
