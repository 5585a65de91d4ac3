"""A piece of advice, and how it is kept in a result."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from dforce.core.errors import checked
from dforce.core.listing import Listing, html_table, paragraphs
from dforce.core.quantities import NONE
from dforce.results.dataset import unit_for

if TYPE_CHECKING:
    import xarray as xr

TEXT, PIECES = "advice", "advice_pieces"  # attributes of a result: sentences for a reader, JSON for a program
JOINED = ", as in joined results of several cases. Pass the result of each case by itself."  # ends a text


@dataclass(frozen=True)
class Advice:
    """A warning that the model or the result is not valid.

    Attributes
    ----------
    name
        Short name, constant in all outputs.
    found, limit
        The value and its limit, in `unit`.
    text
        One to three sentences: finding, consequence, remedy.
    source
        Source of the limit.
    about
        Paths in the case that the advice concerns, such as ``("drive.A0", "forces.dmt")``.
    unit
        SI unit of both figures; ``"1"`` for plain numbers.
    """

    name: str
    found: float
    limit: float
    text: str
    source: str
    about: tuple[str, ...]
    unit: str = "1"

    @property
    def figures(self) -> str:
        """Both values as text with units: ``found 1.1 nm, limit 1 nm``."""
        return f"found {shown(self.found, self.unit)}, limit {shown(self.limit, self.unit)}"

    @property
    def finding(self) -> str:
        """The finding: the first sentence of the text."""
        return self.text.split(". ")[0].removesuffix(".") + "."


class Advices(Listing[Advice]):
    """The result of :func:`dforce.advice`: a list, shown as a table, or as a paragraph for each piece."""

    def as_text(self) -> str:
        """Return name, figures and text of each piece."""
        return paragraphs((f"{piece.name}: {piece.figures}", piece.text) for piece in self) or "no advice"

    def as_html(self) -> str:
        """Return a row for each piece."""
        if not self:
            return "<p>no advice</p>"
        rows = [(piece.name, piece.text, piece.figures, piece.source) for piece in self]
        return html_table(rows, ("advice", "what to know", "figures", "source of the limit"))


def attributes(pieces: list[Advice]) -> dict[str, str]:
    """Return the attributes that keep advice in a result."""
    return {
        TEXT: "\n".join(piece.text for piece in pieces),
        PIECES: json.dumps([dataclasses.asdict(piece) for piece in pieces], ensure_ascii=False) if pieces else "[]",
    }


@checked
def advice_in(result: xr.Dataset) -> Advices:
    """Return the advice that a result contains since its computation; the list may be empty."""
    kept: list[dict[str, Any]] = json.loads(result.attrs.get(PIECES, "[]"))
    return Advices(Advice(**piece | {"about": tuple(piece["about"])}) for piece in kept)


def shown(value: float, unit: str) -> str:
    """Return an SI value in the unit that a reader likes: ``0.27 nm``."""
    scale, name = unit_for(abs(value), unit)
    number = value / scale
    text = f"{number:.3g}" if abs(number) < 1000.0 else f"{number:.0f}"
    return f"{text} {name}" if unit != "1" else text


def amount(value: float, unit: str) -> str:
    """Return an SI amount in the unit that a reader likes; "none" where it is 0, as evidence gives it below its error."""
    return shown(value, unit) if value else NONE


def percent(share: float) -> str:
    """Return a share in percent: ``27 %``; beyond 100 times no digit means anything."""
    if abs(share) > 100.0:
        return "more than 10000 %"
    return f"{rounded(100.0 * share, '.2g' if abs(share) < 0.995 else '.0f')} %"


def rounded(value: float, digits: str = ".2g") -> str:
    """Return a number with few digits, below a million without an exponent: ``150``."""
    return f"{float(f'{value:{digits}}'):g}"
