"""Tells a person in a sentence why something could not be done."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator

from nicegui import ui

import dforce as df
from dforce.gui.document.store import why

log = logging.getLogger("dforce.gui")

UNKNOWN = "An error inside dForce, please report it."


def say(sentence: str) -> None:
    """Show a sentence until it has been read."""
    ui.notify(sentence, type="negative", multi_line=True, close_button="Close", timeout=15_000)


def as_sentence(words: str) -> str:
    """Return the words of an error as a sentence."""
    first = words.partition(" ")[0]
    is_name = any(sign in first for sign in "._=")  # of a file or a key: it stays as it is written
    return f"{words[:1] if is_name else words[:1].upper()}{words[1:]}{'' if words.endswith('.') else '.'}"


@contextlib.contextmanager
def telling(what: str) -> Iterator[None]:
    """Say in a sentence why what is done inside failed; `what` names it, such as "the file could not be opened"."""
    try:
        yield
    except df.DForceError as error:
        say(as_sentence(str(error)))
    except OSError as error:  # a full disk, say, or a folder that may not be written: nothing that dForce can mend
        say(as_sentence(f"{what}: {why(error)}"))
    except Exception:  # a defect must not leave a person without a word
        log.exception(what)
        say(UNKNOWN)
