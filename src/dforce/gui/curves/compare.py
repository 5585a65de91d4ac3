"""What results have in common and what differs between them: names, colors, and the table of parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import dforce as df
from dforce.core.errors import shorten
from dforce.core.notation import plain_math
from dforce.core.toml import read_toml
from dforce.gui.document.document import COLORS, EDITED, LONGEST_NAME, KeptResult

if TYPE_CHECKING:
    import xarray as xr

NOT_COMPARED = ("title", "about", "plugins", "data", "fit", "sweep")
NOTHING = "–"
LONGEST_VALUE = 60
IN_A_NAME = 2  # differences that make a name; more make none that can be read


@dataclass(frozen=True)
class Difference:
    """A parameter in which results differ: its path, words and symbol, and the value of each result as text."""

    path: str
    label: str
    symbol: str
    values: tuple[str, ...]


def differences(results: Sequence[xr.Dataset]) -> list[Difference]:
    """Return the parameters in which the cases of results differ, in the order of a case file."""
    cases = [_values(str(result.attrs.get("case", ""))) for result in results]
    paths = dict.fromkeys(path for case in cases for path in case)
    found = []
    for path in paths:
        values = tuple(case.get(path, NOTHING) for case in cases)
        if len(set(values)) > 1:
            owner = next(result for result, case in zip(results, cases, strict=True) if path in case)
            found.append(Difference(path, *_words(owner, path), values))
    return found


def name_of(result: xr.Dataset, last: xr.Dataset | None, taken: Sequence[str]) -> str:
    """Return a name for a result that tells it from the last one: what differs, or the title with a number."""
    title = str(result.attrs.get("title", "")) or "Result"
    if last is not None and _original(last) == _original(result):
        rows = differences([last, result])
        if 0 < len(rows) <= IN_A_NAME:
            title = ", ".join(f"{plain_math(row.symbol) or row.label} = {row.values[1]}" for row in rows)
    name, number = shorten(title, LONGEST_NAME - 6), 1
    while name in taken:
        number += 1
        name = f"{shorten(title, LONGEST_NAME - 6)} ({number})"
    return name


def _original(result: xr.Dataset) -> str:
    """Return the title of a result before its case was edited."""
    return str(result.attrs.get("title", "")).removesuffix(EDITED)


def color_of(others: Sequence[KeptResult]) -> int:
    """Return the color that the fewest of the results have."""
    used = [kept.color for kept in others]
    return min(range(1, COLORS), key=lambda color: (used.count(color), color))


def _values(toml: str) -> dict[str, str]:
    """Return the parameters of a case by path, as the texts that its file holds."""
    try:
        table = read_toml(toml)
    except ValueError:
        return {}
    return {path: value for path, value in _flat("", table) if path.partition(".")[0] not in NOT_COMPARED}


def _flat(path: str, value: object) -> Iterator[tuple[str, str]]:
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _flat(f"{path}.{key}" if path else str(key), inner)
    elif isinstance(value, list) and value and isinstance(value[0], Mapping):
        names = [str(item.get("model", "")) for item in value]
        for number, (name, inner) in enumerate(zip(names, value, strict=True), start=1):
            yield from _flat(f"{path}.{name if name and names.count(name) == 1 else number}", inner)
    elif isinstance(value, list):
        yield path, shorten(", ".join(map(str, value)), LONGEST_VALUE)
    else:
        yield path, shorten(str(value), LONGEST_VALUE)


def _words(result: xr.Dataset, path: str) -> tuple[str, str]:
    """Return the words and the symbol that are declared for a parameter; its path where it is no quantity."""
    try:
        quantity = df.Case.from_toml(str(result.attrs["case"])).quantity(path)
    except (df.DForceError, TypeError, KeyError):
        return path.rpartition(".")[2].replace("_", " "), ""
    return quantity.doc.partition(";")[0].partition(":")[0], quantity.symbol
