"""A docstring with equations, readable in a terminal: LaTeX becomes letters, fractions and signs."""

from __future__ import annotations

import inspect
import shutil
import textwrap

from dforce import plain_math, unmarked

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
            words = unmarked(" ".join(part.strip() for part in paragraph))
            blocks.append(textwrap.fill(words, width(), subsequent_indent=hanging))
    return "\n\n".join(blocks)
