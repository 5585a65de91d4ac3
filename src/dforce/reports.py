"""A result in short, as a notebook or a terminal shows it: picture, findings, advice."""

from __future__ import annotations

import base64
import html
import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dforce.errors import ParameterError
from dforce.findings import Finding, summary
from dforce.validity import Advice, advice_in

if TYPE_CHECKING:
    import xarray as xr

DPI = 72  # of the picture: small, and its words can still be read


@dataclass(frozen=True)
class Report:
    """What a result says in short; a notebook shows it with a picture.

    Attributes
    ----------
    dataset
        The result.
    title
        Its title.
    findings
        What a reader looks for first (:func:`dforce.summary`).
    advice
        Where the result stops meaning what it seems to say.
    """

    dataset: xr.Dataset
    title: str
    findings: tuple[Finding, ...]
    advice: tuple[Advice, ...]

    def picture(self) -> bytes:
        """Return the picture that says most about the result (:func:`dforce.plot.overview`), as PNG."""
        from dforce import plot
        from dforce.plot._style import figure_of

        file = io.BytesIO()
        figure_of(plot.overview(self.dataset)).savefig(file, format="png", dpi=DPI)
        return file.getvalue()

    def rows(self) -> list[tuple[str, ...]]:
        """Return the findings as rows: label, then a text for each direction."""
        ways = list(dict.fromkeys(finding.direction for finding in self.findings))
        rows: dict[str, dict[str, str]] = {}
        for finding in self.findings:
            rows.setdefault(finding.label, {})[finding.direction] = finding.text
        body = [(label, *(texts.get(way, "") for way in ways)) for label, texts in rows.items()]
        return [("", *ways), *body] if len(ways) > 1 else body

    def __repr__(self) -> str:
        """Show the report as text."""
        rows = self.rows()
        widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))] if rows else []
        lines = [
            "   ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
        ]
        return "\n".join([self.title, *lines, *(f"advice: {piece.text}" for piece in self.advice)])

    def _repr_html_(self) -> str:
        rows = "".join(
            "<tr>" + "".join(f'<td style="text-align: left">{html.escape(cell)}</td>' for cell in row) + "</tr>"
            for row in self.rows()
        )
        advice = "".join(
            f"<li><b>{html.escape(piece.name)}</b>: {html.escape(piece.text)} "
            f"({html.escape(piece.figures)}; {html.escape(piece.source)})</li>"
            for piece in self.advice
        )
        picture = base64.b64encode(self.picture()).decode()
        return (
            f"<div><strong>{html.escape(self.title)}</strong>"
            f'<br><img alt="overview of the result" src="data:image/png;base64,{picture}">'
            f"<table><tbody>{rows}</tbody></table>" + (f"<p>Advice</p><ul>{advice}</ul>" if advice else "") + "</div>"
        )


def report(result: xr.Dataset) -> Report:
    """Return a result in short; the last line of a notebook's cell shows it with a picture.

    Raises
    ------
    ParameterError
        For a sweep: choose one of its cases with ``.isel``.
    """
    swept = [
        path for path in str(result.attrs.get("over", "")).split() if {path, path.split(".")[-1]} & set(result.dims)
    ]
    if swept:
        raise ParameterError(f"this is a sweep over {', '.join(swept)}; choose one of its cases with .isel")
    return Report(result, str(result.attrs.get("title", "")), tuple(summary(result)), tuple(advice_in(result)))
