"""The streams that commands print to: of any character set, on a full disk, or closed."""

from __future__ import annotations

import codecs
import contextlib
import errno
import io
import os
import sys
import unicodedata
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO, cast

import dforce as df

PLAIN = {
    "°": " deg", "µ": "u", "μ": "u", "–": "-", "—": "-", "−": "-", "×": "x", "·": " ", "√": "sqrt ",
    "←": "<-", "→": "->", "²": "^2", "³": "^3", "≤": "<=", "≥": ">=", "≈": "~", "∞": "infinity",
    "\N{COMBINING DOT ABOVE}": "'", "\N{COMBINING MACRON}": "_bar",
}  # fmt: skip


def plain(error: UnicodeError) -> tuple[str, int]:
    """Spell out characters that a terminal's character set lacks: µ as u, δ as delta."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    spelled = []
    for character in error.object[error.start : error.end]:
        name = unicodedata.name(character, "")
        if character in PLAIN:
            spelled.append(PLAIN[character])
        elif name.startswith("GREEK"):
            spelled.append(name.split()[3].lower())
        else:
            decomposed = unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()
            spelled.append(decomposed or "?")
    return "".join(spelled), error.end


class Outlet:
    """A stream of text whose disk may be full.

    Parameters
    ----------
    stream
        The stream to write to.
    needed
        Whether unwritable text is an error; otherwise it is dropped.
    """

    def __init__(self, stream: TextIO, needed: bool) -> None:
        self._stream, self.needed = stream, needed

    def __getattr__(self, name: str) -> Any:
        """Be the stream in all the rest."""
        if name == "buffer":  # typer would write there, past this outlet, where the character set is ASCII
            raise AttributeError(name)
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write text; return its length."""
        try:
            return self._stream.write(text)
        except OSError as error:
            self._lose(error)
        return len(text)

    def flush(self) -> None:
        """Flush the stream."""
        try:
            self._stream.flush()
        except OSError as error:
            self._lose(error)

    def _lose(self, error: OSError) -> None:
        # its reader has seen enough; Windows has another word for a closed pipe
        if not self.needed or isinstance(error, BrokenPipeError) or error.errno == errno.EINVAL:
            return
        raise df.ResultError(f"the output could not be written: {str(error.strerror).lower()}") from error


@contextlib.contextmanager
def careful() -> Iterator[None]:
    """Let both output streams spell out characters that they cannot encode, and lose no work when they are full.

    Unwritable text for stdout is an error. Text for stderr is dropped, and so is text whose reader has gone: the command
    does its work and keeps its exit code.
    """
    codecs.register_error("dforce-plain", plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="dforce-plain")
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere:  # in the place of a stream that is closed
        out, err = Outlet(sys.stdout or nowhere, needed=True), Outlet(sys.stderr or nowhere, needed=False)
        sys.stdout, sys.stderr = cast(TextIO, out), cast(TextIO, err)
        try:
            yield
        finally:
            out.needed = False
