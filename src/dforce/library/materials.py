"""Samples by name: nominal values with their source, as data."""

from __future__ import annotations

import functools
import math
import tomllib
from dataclasses import dataclass
from importlib import resources
from typing import Any

from dforce.core import units
from dforce.core.errors import Catalog
from dforce.core.listing import Shown, aligned, html_table


@dataclass(frozen=True)
class Material:
    """A sample known by name, with its nominal values in SI; None for a value without a source.

    Attributes
    ----------
    name, source
        Name of the material, and source of its values.
    youngs_modulus, low, high
        Young's modulus (Pa), and its range in the source.
    poisson_ratio
        Poisson's ratio.
    hamaker, hamaker_in_water
        Hamaker constant (J) of the material with itself across vacuum or air, and across water.
    """

    name: str
    source: str
    youngs_modulus: float
    low: float | None = None
    high: float | None = None
    poisson_ratio: float | None = None
    hamaker: float | None = None
    hamaker_in_water: float | None = None

    @property
    def range(self) -> str:
        """The range of Young's modulus as text, empty where the source gives one value."""
        if self.low is None or self.high is None:
            return ""
        return units.show_range(self.low, self.high, "Pa", 3)

    def hamaker_with(self, other: Material, medium: str = "air") -> float | None:
        """Return the Hamaker constant (J) of two materials across air, vacuum or water; None where one has no value.

        It is the geometric mean of the two constants, the rule of Berthelot: P. Walstra, Physical Chemistry of Foods,
        Marcel Dekker (2003), table 12.1.
        """
        name = "hamaker_in_water" if medium == "water" else "hamaker"
        mine, others = getattr(self, name), getattr(other, name)
        known = mine is not None and others is not None and medium in ("air", "vacuum", "water")
        return math.sqrt(mine * others) if known else None

    def cells(self) -> tuple[str, ...]:
        """Return the cells of its row in a table."""
        return (
            self.name,
            units.show(self.youngs_modulus, "Pa", 3),
            self.range,
            "" if self.poisson_ratio is None else f"{self.poisson_ratio:g}",
            *("" if value is None else units.show(value, "J", 3) for value in (self.hamaker, self.hamaker_in_water)),
        )

    def as_text(self) -> str:
        """Return all that is known of it, a line for each value."""
        lines = [(head, cell) for head, cell in zip(HEAD[1:], self.cells()[1:], strict=True) if cell]
        return aligned([*lines, ("source", self.source), ("nominal", NOMINAL)])


HEAD = ("name", "Young's modulus", "range", "Poisson's ratio", "Hamaker constant in air", "in water")
NOMINAL = "your sample may differ by the whole range; a Hamaker constant is for two bodies of the material"


class Materials(Shown, Catalog[Material]):
    """The result of :func:`materials`: a dict by name, shown as a table."""

    kind = "material"
    listed_by = "dforce materials"

    def as_text(self) -> str:
        """Return a row for each."""
        return f"{aligned([HEAD, *(material.cells() for material in self.values())])}\nnominal values: {NOMINAL}"

    def as_html(self) -> str:
        """Return a row for each."""
        return html_table([material.cells() for material in self.values()], HEAD)


@functools.cache
def materials() -> Materials:
    """Return the known samples by name, in SI, each with its source; a notebook draws the dict as a table."""
    text = (resources.files(__package__) / "materials.toml").read_text(encoding="utf-8")
    return Materials({name: _material(name, row) for name, row in tomllib.loads(text).items()})


def _material(name: str, row: dict[str, Any]) -> Material:
    low, high = (units.parse(end, "Pa") for end in row["range"]) if "range" in row else (None, None)
    across = row.get("hamaker", {})
    hamaker, in_water = (units.parse(across[one], "J") if one in across else None for one in ("vacuum", "water"))
    modulus = units.parse(row["youngs_modulus"], "Pa")
    return Material(name, row["source"], modulus, low, high, row.get("poisson_ratio"), hamaker, in_water)
