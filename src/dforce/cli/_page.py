"""A docstring with equations, readable in a terminal: LaTeX becomes letters, fractions and signs."""

from __future__ import annotations

import inspect
import textwrap

from dforce.cli._terminal import width, wrapped
from dforce.core.notation import plain_math, unmarked


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
            equation = plain_math("\n".join(body).replace("\n", " ").strip())
            blocks.append("\n".join(map(_fitted, textwrap.indent(equation, "    ").split("\n"))))
        elif line.strip():
            paragraph = [line]
            while lines and lines[0].strip() and not lines[0].startswith((".. ", "- ")):
                paragraph.append(lines.pop(0))
            hanging = "  " if line.startswith("- ") else ""
            words = unmarked(" ".join(part.strip() for part in paragraph))
            blocks.append(wrapped(words, width(), then=hanging))
    return "\n\n".join(blocks)


def _fitted(line: str) -> str:
    """Return a line of an equation, on several lines where it is too long for one."""
    margin = line[: len(line) - len(line.lstrip())]
    return line if len(line) <= width() else wrapped(line, width(), margin, margin + "    ")
