"""One curve: a table's columns become quantities in SI units; impossible values are refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

from dforce.core import units
from dforce.core.arrays import Array, Texts
from dforce.core.errors import ParameterError, ResultError, UnitError, nearest, shorten
from dforce.core.quantities import AXES, OBSERVABLES
from dforce.inverse import placing
from dforce.inverse.heights import height_error, sensor_noise, walk_of
from dforce.inverse.quantities import MEASURED
from dforce.inverse.readers import READERS
from dforce.inverse.table import RETRACT, Column, MeasuredTable, Reader, segment_of
from dforce.inverse.words import MEANINGS, TO_PEAK, is_of, known_unit
from dforce.results.provenance import provenance

if TYPE_CHECKING:
    import xarray as xr

CONVENTIONS = {"lag": (1.0, 0.0), "lag-90": (1.0, 90.0), "90-lag": (-1.0, 90.0), "lead": (-1.0, 0.0)}
"""Sign and offset (degrees) that make a lag of a phase as a file holds it."""
UNKNOWN = "unknown"
OPTIONAL = ("amplitude_2", "phase_2", "deflection", "frequency", "frequency_shift", "excitation", "time", "branch")
NOTES = {"k": "N/m", "f0": "Hz", "Q": "1", "A0": "m", "drive_frequency": "Hz", "sensitivity": "m/V"}
"""Settings that a file may note beside the columns, with their SI units."""
SOME = 10  # points at an end of a curve, at most a tenth of it, that show whether the amplitude falls toward it
CLEAR = 5.0  # errors
GIVE_THE_SIGN = "write height_grows = 'toward' if larger numbers are nearer to the sample, else 'away'"


class ReadKeywords(TypedDict, total=False):
    """The same as a user types it; see :func:`dforce.read_measured`."""

    columns: Mapping[str, str] | None
    units: Mapping[str, str] | None
    sensitivity: float | str | None
    amplitude_is: str | None
    phase_convention: str | None
    height: str | None
    height_grows: str | None
    direction: str | None


@dataclass(frozen=True)
class ReadOptions:
    """The user's statements on a file, checked; see :func:`dforce.read_measured`."""

    columns: Mapping[str, str]
    units: Mapping[str, str]
    sensitivity: float | str | None = None
    amplitude_is: str | None = None
    phase_convention: str | None = None
    height: str | None = None
    height_grows: str | None = None
    direction: str | None = None

    @classmethod
    def of(cls, keywords: ReadKeywords | Mapping[str, Any]) -> ReadOptions:
        """Return the settings, after a check of their words.

        Raises
        ------
        ParameterError
            For an unknown word, with the nearest word.
        """
        asked = cls(**{**keywords, "columns": keywords.get("columns") or {}, "units": keywords.get("units") or {}})
        for name, table in (("columns", asked.columns), ("units", asked.units)):
            for key, value in table.items():
                if key not in MEANINGS:
                    raise ParameterError(
                        f"{name}: there is no quantity '{shorten(key)}'{nearest(str(key)[:100], MEANINGS)}"
                    )
                if not isinstance(value, str):
                    raise ParameterError(f"{name}: {key} = {shorten(value)} is not text")
        choices = {
            "amplitude_is": tuple(TO_PEAK),
            "phase_convention": tuple(CONVENTIONS),
            "height": ("sensor", "piezo"),
            "height_grows": ("away", "toward"),
            "direction": ("approach", "retract"),
        }
        for name, words in choices.items():
            given = getattr(asked, name)
            if given is not None and given not in words:
                raise ParameterError(f"{name} = '{shorten(given)}' is not one of {', '.join(words)}")
        return asked


def curve_of(table: MeasuredTable, asked: ReadOptions, name: str) -> xr.Dataset:
    """Return a curve as a Dataset, in the order of its walk.

    Raises
    ------
    ResultError
        For numbers that are missing or make no curve.
    ParameterError
        Where the file lacks necessary information.
    """
    import xarray as xr

    found = placing.place(table, asked.columns, asked.height, name)
    placing.refuse_missing(found, table, name)
    history = [f"read: {table.reader}"]
    values = _values(found, table, asked, name, history)
    known = _turn_heights(values, found["height"], table.reader, asked.height_grows, history)
    if (span := float(np.ptp(values["height"]))) < placing.SHORTEST:
        history.append(
            f"doubt: the heights span only {units.show(span, 'm', 3)}; the unit is wrong, or commas or points separate "
            "thousands"
        )
    walk = walk_of(table, values["height"], _segments(found, table, name), asked.direction, name)
    values = {key: column[walk.rows] for key, column in values.items()}
    if len(walk.rows) < placing.FEWEST:
        raise ResultError(f"{name} has {len(walk.rows)} points, but a curve needs {placing.FEWEST} or more")
    history += walk.history
    if asked.height_grows is None:
        _check_orientation(values, known, name, history)
    unsure = height_error(values["height"], walk.directions)
    if unsure:
        history.append(
            f"height: repeats or turns back within the noise of the sensor, about {units.show(unsure, 'm', 2)}"
        )
    convention = asked.phase_convention or table.notes.get("phase_convention")
    if "phase" in values:
        convention = _turn_phases(values, convention, walk.directions, name, history)
    taken = {column.name for column in found.values()}
    left = [column.name for column in table.columns if column.name not in taken]
    if left:
        history.append(f"left out: the columns {', '.join(shorten(one, 30) for one in left[:20])}")
    data = xr.Dataset(
        {key: ("point", column.astype(np.int8) if key == "branch" else column) for key, column in values.items()},
        coords={"direction": ("point", walk.directions)},
        attrs=provenance("", "") | _notes(table, history),
    )
    data.attrs |= {"phase_convention": convention} if "phase" in values else {}
    data.attrs["height_kind"] = placing.HEIGHT_WORDS[found["taken"].name]
    if table.position is not None:
        data.attrs |= {"x": table.position[0], "y": table.position[1]}
    data.attrs |= {"height_error": unsure} if unsure else {}
    data.attrs["history"] = history
    if "excitation" in data:
        data["excitation"].attrs["units"] = found["excitation"].unit or "1"
    return described(data)


def _values(
    found: Mapping[str, Column], table: MeasuredTable, asked: ReadOptions, name: str, history: list[str]
) -> dict[str, Array]:
    """Return the columns that are used, in SI units."""
    values: dict[str, Array] = {}
    wanted = [quantity for quantity in ("height", "amplitude", "phase", *OPTIONAL) if quantity in found]
    for quantity in wanted:
        taken = found["taken"].name if quantity == "height" else quantity
        unit = asked.units.get(quantity) or asked.units.get(taken)
        column = found[quantity]
        is_empty = column.values.dtype.kind == "f" and not np.isfinite(column.values).any()
        if quantity in OPTIONAL and quantity not in asked.columns and is_empty:
            history.append(f"left out: the {quantity.replace('_', ' ')}, a column without numbers")
            continue
        try:
            values[quantity] = placing.in_si(taken, column, unit, asked.sensitivity, name)
        except UnitError:
            if quantity != "deflection" or quantity in asked.columns:  # volts or newtons: not needed for anything
                raise
            history.append(f"left out: the deflection, in {column.unit}")
            continue
        placing.refuse_gaps(quantity, values[quantity], table, name)
        placing.refuse_size(quantity, values[quantity], str(unit or column.unit), name)
        if quantity in placing.AMPLITUDES:
            scale, sentence = placing.amplitude_scale(column, asked.amplitude_is, table.reader, name)
            values[quantity] = scale * values[quantity]
            history += [sentence] if quantity == "amplitude" else []
            _refuse_negative(quantity, values[quantity], table, name)
        said = known_unit(unit) if unit else column.unit
        unused = quantity == "amplitude" and asked.sensitivity is not None and not is_of(str(said), "V")
        history.append(
            f"{quantity}: column '{column.name}'"
            + (f" in {unit or column.unit}" if unit or column.unit else "")
            + ("; the sensitivity is not used" if unused else "")
        )
    if "branch" in values and not np.isin(values["branch"], (1.0, -1.0)).all():
        raise ResultError(f"{name} has a branch that is neither 1 (attractive) nor -1 (repulsive)")
    kind = placing.HEIGHT_WORDS[found["taken"].name]
    others = [key for key in placing.HEIGHTS if key in found and found[key] is not found["height"]]
    if kind != "as named in the file":
        aside = f"; the {placing.HEIGHT_WORDS[others[0]]} is not used" if others else ""
        history.append(
            f"height: of the {kind}{aside}"
            + (", without the creep and hysteresis of the piezo" if kind == "piezo" else "")
        )
    return values


def _turn_heights(
    values: dict[str, Array], column: Column, reader: Reader, given: str | None, history: list[str]
) -> bool:
    """Make larger heights farther from the sample, in place, if their sign is set or known; return whether it is."""
    grows = given or reader.sign_of(column.name)
    if grows == "toward":
        values["height"] = -values["height"]
        why = "as set" if given else f"as in files of {reader.maker}"
        history.append(f"height: larger numbers are nearer to the sample, {why}; the sign is turned")
    return grows is not None


def _refuse_negative(quantity: str, values: Array, table: MeasuredTable, name: str) -> None:
    below = np.flatnonzero(values < 0.0)
    if len(below):
        where = table.place(int(below[0]))
        raise ResultError(
            f"{name} has an {quantity} below zero in {where}: {units.show(float(values[below[0]]), 'm', 4)}"
        )


def _segments(found: Mapping[str, Column], table: MeasuredTable, name: str) -> Texts | None:
    """Return the part that each row belongs to, by a column of words or by the file's own."""
    column = found.get("direction")
    if column is None:
        return table.segments
    words = [segment_of(str(word)) for word in column.values]
    for row, word in enumerate(words):
        if word is None:
            raise ResultError(
                f"{name} has the direction '{shorten(str(column.values[row]), 30)}' in {table.place(row)}, "
                "which is neither approach nor retract"
            )
    return np.array(words)


def _check_orientation(values: Mapping[str, Array], known: bool, name: str, history: list[str]) -> None:
    """Check by the curve that larger heights are farther from the sample.

    Toward the sample the amplitude falls; with a frequency shift, its size grows.

    Raises
    ------
    ParameterError
        Where the curve shows the contrary, and where it shows nothing and the sign is not known.
    """
    quantity = "frequency_shift" if "frequency_shift" in values else "amplitude"
    words, grows = quantity.replace("_", " "), height_sign(values)
    if grows == "toward":
        shown = "smaller amplitudes" if quantity == "amplitude" else "larger frequency shifts"
        raise ParameterError(f"{name} has {shown} at larger heights, a sign of the sample there: {GIVE_THE_SIGN}")
    if known:
        return
    if grows is None:
        raise ParameterError(
            f"{name} does not show the side of the sample: the {words} is equal at both ends, and the sign "
            f"of its heights is unknown: {GIVE_THE_SIGN}"
        )
    shown = "the amplitude falls toward smaller ones" if quantity == "amplitude" else "its size grows at smaller ones"
    history.append(f"height: larger numbers are farther from the sample, as {shown}")


def height_sign(values: Mapping[str, Array]) -> str | None:
    """Return where larger heights are, "away" from the sample or "toward" it, by the ends of a curve; None if unclear.

    `values` has `height` and `frequency_shift` or `amplitude`, in any units.
    """
    quantity = "frequency_shift" if "frequency_shift" in values else "amplitude"
    order = np.argsort(values["height"], kind="stable")
    if len(order) < 4:
        return None
    far_from_it = -np.abs(values[quantity][order]) if quantity == "frequency_shift" else values[quantity][order]
    count = max(min(SOME, len(order) // 10), 2)
    noise = max(sensor_noise(far_from_it) * np.sqrt(2.0 / count), 1e-3 * float(np.abs(far_from_it).max()))
    rise = float(far_from_it[-count:].mean()) - float(far_from_it[:count].mean())
    if not abs(rise) > CLEAR * noise:  # where all is zero, too
        return None
    return "away" if rise > 0.0 else "toward"


def _turn_phases(
    values: dict[str, Array], convention: str | None, directions: Texts, name: str, history: list[str]
) -> str:
    """Make lags of the phases, in place, where their convention is known; return the convention that they have then."""
    if convention is not None and convention not in CONVENTIONS:
        raise ParameterError(f"{name} notes the phase convention '{shorten(convention)}', an unknown convention")
    for key in ("phase", "phase_2"):
        if key not in values:
            continue
        phase = values[key]
        if float(np.ptp(phase)) == 0.0:
            raise ResultError(f"{name} has the same {key} at every point, so it was not measured")
        turned = phase.copy()
        for word in np.unique(directions):
            turned[directions == word] = np.unwrap(phase[directions == word], period=360.0)
        _join(turned, directions)
        if not np.array_equal(turned, phase):
            history.append(f"{key}: jumps of 360° between neighbors are removed")
        if convention is not None:
            sign, offset = CONVENTIONS[convention]
            turned = sign * turned + offset
        values[key] = turned
    if convention is None:
        history.append("phase: as in the file, because its sign is unknown")
        return UNKNOWN
    history.append(f"phase: '{convention}' in the file, with the lag behind the drive")
    return "lag"


def _join(phase: Array, directions: Texts) -> None:
    """Take whole turns out between the ends of approach and retract, in place."""
    back = directions == RETRACT
    if back.any() and not back.all():
        phase[back] += 360.0 * np.round((np.median(phase[~back]) - np.median(phase[back])) / 360.0)


def _notes(table: MeasuredTable, history: list[str]) -> dict[str, float | str]:
    """Return the settings of lever, drive and instrument in the file, and list them; text may come from any maker."""
    found: dict[str, float | str] = {}
    for name, unit in NOTES.items():
        text = _noted(table, name)
        if text is None:
            continue
        try:
            value = units.parse(text, unit)
        except UnitError:
            continue  # a note of another program under the same key
        if value > 0.0:
            found[name] = value
            history.append(f"{name}: {units.show(value, unit, 6)}, from the file")
    instrument = _noted(table, "instrument") or table.reader.maker
    return found | ({"instrument": instrument} if instrument else {})


def _noted(table: MeasuredTable, name: str) -> str | None:
    """Return a setting in the file, under dForce's key or a maker's."""
    keys = [name, *(reader.notes[name] for reader in (table.reader, *READERS) if name in reader.notes)]
    return next((table.notes[key] for key in keys if key in table.notes), None)


def described(data: xr.Dataset) -> xr.Dataset:
    """Give every variable of a measured curve its unit, name and description; in place, and returned.

    The unit of the excitation stays as it is.
    """
    known = AXES | OBSERVABLES | MEASURED
    for key, variable in data.variables.items():
        if row := known.get(str(key)):
            kept = {"units": variable.attrs.get("units", "1")} if key == "excitation" else {}
            variable.attrs.update(row.words | kept)
    return data
