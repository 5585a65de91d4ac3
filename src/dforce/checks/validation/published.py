"""Values of published equations, found again by dForce: the tables in the folder ``values``."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from functools import cache
from importlib import resources
from typing import Any

from dforce.checks.validation.checks import Check, ValidationPart, deviation
from dforce.checks.validation.motions import MOTION_RECIPES
from dforce.checks.validation.recipes import FORCE_RECIPES

TABLES = ("forces", "layer", "lever", "motion")
RECIPES = {**FORCE_RECIPES, **MOTION_RECIPES}
TEXT = (
    "Each value was computed outside dForce, from the named equation or by two independent integrators. dForce must agree to "
    "half a unit of the last digit; a note explains any other limit. The motions come from the engine, settled "
    "to 1e-11 of A0."
)


@cache
def entries(table: str) -> tuple[dict[str, Any], ...]:
    """Return the values of a table, each with all that its group holds."""
    text = (resources.files(__package__) / "values" / f"{table}.toml").read_text(encoding="utf-8")
    return tuple(
        {"group": group["title"], "source": group["source"], "unit": group["unit"], "recipe": group["recipe"]}
        | group.get("given", {})
        | value
        for group in tomllib.loads(text)["group"]
        for value in group["values"]
    )


OF_THE_TABLE = ("group", "source", "unit", "recipe", "what", "expected", "within", "of", "note")


def check(entry: dict[str, Any]) -> Check:
    """Return an entry of a table, compared with the value of dForce."""
    given = {key: value for key, value in entry.items() if key not in OF_THE_TABLE}
    found, expected = RECIPES[entry["recipe"]](given), entry["expected"]
    error, limit = deviation(found, expected, entry.get("within"), entry.get("of"))
    return Check(
        entry["group"],
        entry["what"],
        found,
        float(expected),
        entry["unit"],
        error,
        limit,
        entry["source"],
        entry.get("note", ""),
    )


def checks(quick: bool) -> Iterator[Check]:
    """Give the checks of all values; the quick ones leave out motions that take seconds."""
    for table in TABLES:
        for entry in entries(table):
            if not (quick and entry["recipe"] in ("bimodal", "ting", "ting_energy", "ting_detachment", "lee_radok")):
                yield check(entry)


def part(quick: bool) -> ValidationPart:
    """Return this part of the validation."""
    return ValidationPart("values", "Values of published equations", TEXT, tuple(checks(quick)), {})
