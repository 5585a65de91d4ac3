"""Lists and tables of results that show themselves: a table in a notebook, text that can be read elsewhere."""

from __future__ import annotations

import html
import textwrap
from collections.abc import Iterable, Sequence
from typing import Any, SupportsIndex, TypeVar, overload

T = TypeVar("T")
Rows = Sequence[Sequence[str]]
WIDTH = 100  # characters of a line of prose
TABLE = 84  # of a row of a table
LEFT = 'style="text-align: left; vertical-align: top"'


class Shown:
    """A thing that shows itself, as :meth:`__repr__` on a terminal and as HTML in a notebook."""

    def as_text(self) -> str:
        """Return the text for a terminal."""
        raise NotImplementedError

    def as_html(self) -> str:
        """Return the HTML for a notebook, with everything escaped."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return self.as_text()

    __str__ = __repr__

    def _repr_html_(self) -> str:
        return self.as_html()

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:
        """Show the text in IPython, which writes lists in its own way."""
        printer.text(self.as_text())


class Listing(Shown, list[T]):
    """A list, and in all but its looks like any other; a slice of it is one, too."""

    @overload
    def __getitem__(self, place: SupportsIndex) -> T: ...

    @overload
    def __getitem__(self, place: slice) -> Listing[T]: ...

    def __getitem__(self, place: SupportsIndex | slice) -> T | Listing[T]:
        """Return an item, or a part of the list that looks the same."""
        return type(self)(super().__getitem__(place)) if isinstance(place, slice) else super().__getitem__(place)


def in_parts(rows: Rows) -> list[Rows]:
    """Return a table as tables that are no wider than `TABLE`, each with the first column."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    parts: list[list[int]] = []
    used = TABLE
    for place, width in enumerate(widths[1:], 1):
        if used + 3 + width > TABLE:
            parts.append([0])
            used = widths[0]
        parts[-1].append(place)
        used += 3 + width
    return [[[row[place] for place in part] for row in rows] for part in parts]


def aligned(rows: Rows) -> str:
    """Return rows of cells as text in columns."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "   ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )


def paragraphs(items: Iterable[tuple[str, str]]) -> str:
    """Return headings with a paragraph below each."""
    texts = (
        f"{heading}\n{textwrap.fill(text, WIDTH, initial_indent='  ', subsequent_indent='  ')}"
        for heading, text in items
    )
    return "\n".join(texts)


def html_table(rows: Rows, head: Sequence[str] = ()) -> str:
    """Return rows of cells as an HTML table; markup in a cell is shown as text."""
    heading = "".join(f"<th {LEFT}>{html.escape(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td {LEFT}>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table>{f'<thead><tr>{heading}</tr></thead>' if heading else ''}<tbody>{body}</tbody></table>"
