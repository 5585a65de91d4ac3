"""A docstring with equations, readable in a terminal: LaTeX becomes letters, fractions and signs."""

from __future__ import annotations

import inspect
import re
import shutil
import textwrap

from dforce import plain_math

WIDEST = 96  # columns of a paragraph that is easy to read


def width() -> int:
    """Return the columns of a paragraph on this terminal."""
    return min(shutil.get_terminal_size().columns, WIDEST)


def readable(docstring: str) -> str:
    """Return a docstring in reStructuredText as plain paragraphs and indented equations."""
    text = inspect.cleandoc(docstring)
    blocks: list[str] = []
    lines = text.split("\n")
    while lines:
        line = lines.pop(0)
        if line.startswith(".. math::"):
            body = [line.removeprefix(".. math::")]
            while lines and (not lines[0].strip() or lines[0].startswith(" ")):
                body.append(lines.pop(0))
            blocks.append(textwrap.indent(plain_math("\n".join(body).replace("\n", " ").strip()), "    "))
        elif line.strip():
            paragraph = [line]
            while lines and lines[0].strip() and not lines[0].startswith((".. ", "- ")):
                paragraph.append(lines.pop(0))
            hanging = "  " if line.startswith("- ") else ""
            words = _inline(" ".join(part.strip() for part in paragraph))
            blocks.append(textwrap.fill(words, width(), subsequent_indent=hanging))
    return "\n\n".join(blocks)


def _inline(text: str) -> str:
    """Return a paragraph without marks: equations as text, code and names as they are typed."""
    text = re.sub(r":math:`([^`]*)`", lambda match: plain_math(match[1]).strip(), text)
    text = re.sub(r":\w+(?::\w+)?:`~?([^`]*)`", r"\1", text)
    return re.sub(r"``?([^`]*)``?", r"\1", text)


def first_sentence(docstring: str) -> str:
    """Return the first line of a docstring."""
    return _inline(inspect.cleandoc(docstring).split("\n")[0])
