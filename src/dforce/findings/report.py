"""A result in short, as a notebook or a terminal shows it: picture, findings, advice."""

from __future__ import annotations

import base64
import html
import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dforce.core.errors import ParameterError, checked
from dforce.core.listing import aligned, html_table
from dforce.findings.finding import Finding, Findings
from dforce.findings.summary import summary
from dforce.validity import Advice, advice_in

if TYPE_CHECKING:
    import xarray as xr

DPI = 72  # of the picture: small, and its words can still be read


@dataclass(frozen=True)
class Report:
    """A result in short; a notebook shows it with a picture.

    Attributes
    ----------
    dataset
        The result.
    title
        Its title.
    findings
        The main findings (:func:`dforce.summary`).
    advice
        The advice in the result (:func:`dforce.advice`).
    """

    dataset: xr.Dataset
    title: str
    findings: tuple[Finding, ...]
    advice: tuple[Advice, ...]

    def picture(self) -> bytes:
        """Return the picture of the whole result (:func:`dforce.plot.overview`), as PNG."""
        from dforce import plot  # matplotlib is slow to load, and a terminal shows no picture

        file, sheet = io.BytesIO(), plot.Sheet()
        plot.overview(self.dataset, sheet)
        sheet.savefig(file, format="png", dpi=DPI)
        return file.getvalue()

    def rows(self) -> list[tuple[str, ...]]:
        """Return the findings as rows: label, then a text for each direction."""
        return Findings(self.findings).rows()

    def __repr__(self) -> str:
        """Show the report as text."""
        return "\n".join([self.title, aligned(self.rows()), *(f"advice: {piece.text}" for piece in self.advice)])

    def _repr_html_(self) -> str:
        advice = "".join(
            f"<li><b>{html.escape(piece.name)}</b>: {html.escape(piece.text)} "
            f"({html.escape(piece.figures)}; {html.escape(piece.source)})</li>"
            for piece in self.advice
        )
        try:
            drawn = base64.b64encode(self.picture()).decode()
            picture = f'<br><img alt="overview of the result" src="data:image/png;base64,{drawn}">'
        except ParameterError:  # some results are numbers alone
            picture = ""
        return (
            f"<div><strong>{html.escape(self.title)}</strong>{picture}"
            f"{html_table(self.rows())}" + (f"<p>Advice</p><ul>{advice}</ul>" if advice else "") + "</div>"
        )


@checked
def report(result: xr.Dataset) -> Report:
    """Return a short report of a result or a sweep: findings and advice; a notebook adds a picture.

    Raises
    ------
    ParameterError
        As :func:`summary`.
    """
    return Report(result, str(result.attrs.get("title", "")), tuple(summary(result)), tuple(advice_in(result)))
