"""Which column holds which quantity, and its numbers in SI units."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np

from dforce.core import units as known_units
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, ResultError, UnitError, nearest, shorten
from dforce.inverse.table import Column, MeasuredTable, Reader
from dforce.inverse.values import above_zero
from dforce.inverse.words import (
    DENSITY,
    MEANINGS,
    TO_PEAK,
    amplitude_kind,
    bare,
    is_of,
    known_unit,
    naming,
    quantity_of,
    scale_to,
)

HEIGHTS = ("height_sensor", "height", "height_piezo")  # in the order in which they are taken
HEIGHT_WORDS = {"height_sensor": "sensor", "height": "as named in the file", "height_piezo": "piezo"}
NEEDED = ("height", "amplitude", "phase")
AMPLITUDES = ("amplitude", "amplitude_2")
NUMBERS = ("1", "")  # units of quantities that need none
FEWEST = 8  # points of a curve
SHORTEST = 1e-10  # m: heights that span less are no curve
LARGEST = 1e-3  # m: longer than any range of a piezo


def place(table: MeasuredTable, columns: Mapping[str, str], height: str | None, name: str) -> dict[str, Column]:
    """Return the column of each quantity, under "height" that which is taken.

    Raises
    ------
    ParameterError
        For a column that the file lacks, two columns of one quantity, or a quantity that no column seems to hold.
    """
    found = {quantity: _named(table, wanted, quantity, name) for quantity, wanted in columns.items()}
    _refuse_twice(found, name)
    taken = {column.name for column in found.values()}
    for quantity, named in columns_by_name(table).items():
        claimed = [column for column in named if column.name not in taken]
        if quantity in columns or not claimed:
            continue
        if len(claimed) > 1:
            names = ", ".join(f"'{column.name}'" for column in claimed)
            raise ParameterError(
                f"{name} has several columns for the {quantity}: {names}; choose one with {naming(quantity)}"
            )
        found[quantity] = claimed[0]
    return _with_height(found, columns, height, name)


def columns_by_name(table: MeasuredTable) -> dict[str, list[Column]]:
    """Return the columns that seem to hold each quantity, by their names alone."""
    found: dict[str, list[Column]] = {}
    for column in table.columns:
        quantity = quantity_of(column.name, table.reader.names)
        if quantity is not None:
            found.setdefault(quantity, []).append(column)
    return found


def _named(table: MeasuredTable, wanted: str, quantity: str, name: str) -> Column:
    found = [column for column in table.columns if wanted.strip() in _names_of(column)]
    if len(found) > 1:
        raise ParameterError(
            f"{name} has {len(found)} columns '{shorten(wanted)}' for the {quantity}; add the unit, as in 'Amp (nm)', or "
            "rename one in the file"
        )
    if found:
        return found[0]
    known = [column.name for column in table.columns]
    raise ParameterError(f"{name} has no column '{shorten(wanted)}' for the {quantity}{nearest(wanted[:100], known)}")


def _names_of(column: Column) -> tuple[str, ...]:
    """Return how a user may name a column, without and with its unit."""
    name, unit = column.name, column.unit
    return (name, f"{name} ({unit})", f"{name} [{unit}]", f"{name}_{unit}") if unit else (name,)


def _refuse_twice(named: Mapping[str, Column], name: str) -> None:
    """Refuse one column for two quantities."""
    for other, quantity in itertools.combinations(named, 2):
        if named[other] is named[quantity]:
            raise ParameterError(
                f"{name}: the column '{named[quantity].name}' cannot be both {other} and {quantity}; choose another column"
            )


def _with_height(
    found: dict[str, Column], columns: Mapping[str, str], wanted: str | None, name: str
) -> dict[str, Column]:
    """Put the height that is taken under "height"; the sensor comes before the piezo."""
    present = [key for key in HEIGHTS if key in found]
    if wanted is not None:
        key = f"height_{wanted}"
        if key not in found:
            there = ", ".join(f"'{found[one].name}' ({HEIGHT_WORDS[one]})" for one in present) or "none"
            raise ParameterError(f"{name} has no height of the {wanted}; its heights: {there}")
        present = [key]
    if present:
        chosen = "height" if "height" in columns else present[0]
        found = {**found, "height": found[chosen], "taken": Column(chosen, None, found[chosen].values)}
    return found


def refuse_missing(found: Mapping[str, Column], table: MeasuredTable, name: str) -> None:
    """Refuse a table without the quantities that a curve consists of.

    Raises
    ------
    ParameterError
        With the columns that there are, and how to name one.
    ResultError
        Where naming columns cannot help: for a spectrum, and for fewer columns than quantities.
    """
    needed = ("height", "frequency_shift") if "frequency_shift" in found and "phase" not in found else NEEDED
    missing = [quantity for quantity in needed if quantity not in found]
    if missing:
        names = {bare(column.name) for column in table.columns}
        if "frequency" in found and names & set(DENSITY):
            raise ResultError(
                f"{name} is a spectrum of thermal motion, not a curve against height. df.thermal_tune, or dforce thermal "
                "FILE, finds f0, k and Q"
            )
        if len(table.numbers) < len(needed):
            raise ResultError(
                f"{name} has {len(table.numbers)} columns of numbers; a curve has height, amplitude and phase, "
                "or height and frequency shift"
            )
        there = ", ".join(f"'{shorten(column.name, 30)}'" for column in table.columns[:20])
        raise ParameterError(
            f"{name} has no column for the {' or the '.join(missing)}; "
            f"name it with {naming(missing[0])}; its columns: {there}"
        )


def refuse_size(quantity: str, values: Array, unit: str, name: str) -> None:
    """Raise ResultError for lengths that no microscope moves over, as a wrong unit makes them."""
    span = float(np.ptp(values)) if quantity == "height" else float(np.abs(values).max())
    if MEANINGS[quantity].unit == "m" and span > LARGEST:
        says = "range of heights" if quantity == "height" else f"largest {quantity.replace('_', ' ')}"
        remedy = (
            "write the sensitivity with its unit, such as '52 nm/V'"
            if is_of(unit, "V")
            else f"'{unit}' is a wrong unit, so write: units = {{'{quantity}': ...}}"
        )
        raise ResultError(f"{name} has a {says} of {known_units.show(span, 'm', 3)}; {remedy}")


def in_si(quantity: str, column: Column, unit: str | None, sensitivity: float | str | None, name: str) -> Array:
    """Return the numbers of a column in the unit that its quantity is stored in.

    Raises
    ------
    ParameterError
        Without a unit, for volts without a sensitivity, and for a unit of something else. Heights in volts take the
        sensitivity of the piezo as their unit, such as "20 nm/V".
    """
    stored, called = MEANINGS[quantity].unit, quantity.replace("_", " ")
    if column.values.dtype.kind != "f":
        raise ParameterError(f"{name} has words in the column '{column.name}', which should contain the {called}")
    values = np.asarray(column.values, dtype=float)
    in_volts = quantity.startswith("height") and is_of(column.unit or "", "V")
    if in_volts and unit is not None and known_unit(unit) is None:
        return values * scale_to(str(column.unit), "V") * above_zero("units: the sensitivity of the piezo", unit, "m/V")
    said = known_unit(unit) if unit is not None else column.unit
    if unit is not None and not said:
        raise ParameterError(f"units: '{shorten(unit, 40)}' is not a known unit, for the {called}")
    if stored in NUMBERS:
        return values
    if not said:
        raise ParameterError(
            f"{name} has no unit for the {called} (column '{column.name}'); write: "
            f"units = {{'{quantity}': '{known_units.usual_unit(stored)}'}}"
        )
    if quantity in AMPLITUDES and is_of(said, "V"):
        if sensitivity is None:
            raise ParameterError(
                f"{name} has the {called} in {said} (column '{column.name}'); write the sensitivity of the detector, "
                "such as sensitivity = '52 nm/V'"
            )
        return values * scale_to(said, "V") * above_zero("sensitivity", sensitivity, "m/V")
    try:
        return values * scale_to(said, stored)
    except UnitError as error:
        why = str(error).replace("'1 ", "'", 1)
        why += "; write the sensitivity of the piezo: units = {'height': '20 nm/V'}" if in_volts else ""
        raise UnitError(f"{name}: the unit of the {called} (column '{column.name}') {why}") from None


def refuse_gaps(quantity: str, values: Array, table: MeasuredTable, name: str) -> None:
    """Refuse a column that has a value which is no finite number.

    Raises
    ------
    ResultError
        With the first such row.
    """
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise ResultError(
            f"{name} has no finite number for the {quantity} in {table.place(int(bad[0]))}"
            + (f", and in {len(bad) - 1} more" if len(bad) > 1 else "")
            + "; remove such rows, or export the curve again"
        )


def amplitude_scale(column: Column, asked: str | None, reader: Reader, name: str) -> tuple[float, str]:
    """Return the factor from amplitudes to zero-to-peak amplitudes, and a sentence on it.

    Raises
    ------
    ParameterError
        Where a maker's files have either kind, and nothing determines which.
    """
    told = amplitude_kind(column.name)
    if asked is not None and told is not None and asked != told:
        raise ParameterError(f"{name} calls its amplitude '{column.name}', but amplitude_is = '{asked}'")
    kind = asked or told
    if kind is None and reader.amplitude_by_version:
        raise ParameterError(
            f"{name} comes from software of {reader.maker}, with amplitudes in rms or zero to peak, depending on the version: "
            "write amplitude_is = 'rms' or amplitude_is = 'peak'"
        )
    done = {
        "rms": "rms in the file, multiplied by the square root of 2",
        "peak-to-peak": "peak to peak in the file, halved",
    }
    usual = f"zero to peak, {'as set' if kind else 'the default'}"
    return TO_PEAK[kind or "peak"], f"amplitude: {done.get(kind or '', usual)}"


def split_curves(table: MeasuredTable, found: Mapping[str, Column], name: str) -> list[MeasuredTable]:
    """Return the curves in a table whose columns are known by quantity: by `curve`, or by the places `x` and `y` on a map."""
    numbers = {key: found[key] for key in ("curve", "x", "y") if key in found and found[key].values.dtype.kind == "f"}
    keys = ["curve"] if "curve" in numbers else [key for key in ("x", "y") if key in numbers]
    if not keys:
        return [table]
    stacked = np.stack([np.asarray(numbers[key].values, dtype=float) for key in keys], axis=1)
    if not np.isfinite(stacked).all():
        raise ResultError(f"{name} has rows without a {' or '.join(keys)}, so their curve is unknown")
    _, first, which = np.unique(stacked, axis=0, return_index=True, return_inverse=True)
    if keys != ["curve"] and len(first) * FEWEST > len(stacked):
        return [table]  # places that drift from point to point are no map
    order = np.argsort(first)
    parts = [np.flatnonzero(np.ravel(which) == number) for number in order]
    labels = [f"{stacked[rows[0], 0]:g}" if keys == ["curve"] else "" for rows in parts]
    return [
        table.part(rows, _position(numbers, int(rows[0])), label) for rows, label in zip(parts, labels, strict=True)
    ]


def _position(numbers: Mapping[str, Column], row: int) -> tuple[float, float] | None:
    """Return the place of a row on the map (m); None without both coordinates and their units."""
    if not {"x", "y"} <= set(numbers) or not (numbers["x"].unit and numbers["y"].unit):
        return None
    x, y = (float(numbers[key].values[row]) * scale_to(str(numbers[key].unit), "m") for key in ("x", "y"))
    return x, y
