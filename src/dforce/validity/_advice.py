"""What a piece of advice is."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Advice:
    """A place where the chosen model, or a result, stops meaning what it seems to say.

    Attributes
    ----------
    name
        Short name, the same in all languages and places.
    found, limit
        The figure found, and the one it should keep to, in `unit`.
    text
        One or two sentences: what was found, why it matters, what to do.
    source
        Where the limit comes from.
    about
        Paths in the case that the piece is about, such as ``("drive.A0", "forces.dmt")``.
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
