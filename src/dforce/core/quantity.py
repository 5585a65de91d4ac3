"""The description of a quantity in a result: symbol, units, one sentence, and the scale of its error."""

from __future__ import annotations

import enum
import functools
from dataclasses import dataclass, field
from typing import TypeVar


class Scale(enum.Enum):
    """The size that the error of an observable is a share of."""

    LENGTH = "A0 of its tone, else of the first tone"
    PHASE = "1 rad times A0/A"
    SPEED = "omega A0, or omega Y where a base moves farther, by Y"
    PERIOD = "period of the first tone"
    ONE = "1"
    FORCE = "largest force of the motion, or 1e-4 of the driving force where that is larger"
    ENERGY = "k A0^2/Q of its mode, else of the first mode; k A0^2 where Q < 1, and k A0 Y where a base moves farther than A0/Q"
    POWER = "such an energy per period"
    NONE = "none: it describes the solution"


def words(unit: str, label: str, symbol: str, doc: str = "") -> dict[str, str]:
    """Return the attributes by which a variable of a result explains itself; empty ones are left out."""
    said = {"units": unit, "long_name": label, "symbol": symbol, "description": doc}
    return {key: word for key, word in said.items() if word}


@dataclass(frozen=True)
class Quantity:
    """A quantity in a result: its name in the Dataset, symbol, stored unit, unit shown and meaning."""

    name: str
    symbol: str
    unit: str
    shown: str
    label: str
    doc: str
    dims: tuple[str, ...] = ()

    @functools.cached_property
    def words(self) -> dict[str, str]:
        """The attributes of its variable."""
        return words(self.unit, self.label, self.symbol, self.doc)


@dataclass(frozen=True)
class Observable(Quantity):
    """A quantity of a motion, and the scale of its error: by that it counts in the estimated error and the accuracy."""

    scale: Scale = field(kw_only=True)


Row = TypeVar("Row", bound=Quantity)


def table(*rows: Row) -> dict[str, Row]:
    """Return rows by name."""
    return {row.name: row for row in rows}
