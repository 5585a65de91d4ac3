"""Measured files: a curve is read and calibrated, a dialog asks for columns, units and signs; a spectrum tunes the lever."""

from __future__ import annotations

import contextlib
import copy
import re
import tempfile
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.core.files import in_quotes
from dforce.gui.case.values import composed
from dforce.gui.document.document import MeasuredData
from dforce.gui.window.dialogs import LONGEST, Field, choice, dialog, text
from dforce.inverse.fitting.load import known_settings
from dforce.inverse.heads import SPECTRUM, FileHead, HeadColumn, head_of
from dforce.inverse.readers import tables_in
from dforce.inverse.words import MEANINGS, is_of
from dforce.results import hdf5
from dforce.results.files import is_sealed

if TYPE_CHECKING:
    import xarray as xr

CALIBRATED = "neighbor_correlation"  # an attribute that calibration leaves
MOST_BYTES = 10_000_000  # of a file; reading text holds up everybody at the server
SETTINGS = ("columns", "units", "phase_convention", "read", "calibrate")  # of [data], without the file
PHASES = {
    "lag": "lag behind the drive: they rise when the tip is attracted",
    "lead": "they fall when the tip is attracted",
    "lag-90": "0° when free, and they rise when the tip is attracted",
    "90-lag": "0° when free, and they fall when the tip is attracted",
}
AMPLITUDES = {"peak": "zero to peak", "rms": "root mean square (rms)", "peak-to-peak": "peak to peak"}
HEIGHTS = {"toward": "nearer to the sample", "away": "farther from the sample"}
UNITS = {"height": "nm", "phase": "deg"}
# the questions that the table of columns answers
OF_THE_TABLE = re.compile(
    r"no column|several columns|has no unit|cannot be both|units: |the unit of|"
    r"(sensitivity|amplitude_is|height_grows|phase_convention) ="
)
CURVES = re.compile(r"choose one with curve = 1 to (\d+)")
NOISELESS = re.compile(r"write errors = \{'(\w+)'")
# how a function is called: here there is a form
ADVICE = re.compile(r"[;:,] (?:write|pass|name it|choose):? .*", re.DOTALL)

Place = tuple[str, ...]  # of an answer in the table [data]


class MissingAnswer(df.ParameterError):
    """A file lacks information.

    Attributes
    ----------
    head
        The head of the file, for the choice of columns, units and signs.
    asked
        The other questions, by the places of their answers in a table `[data]`.
    """

    def __init__(self, sentence: str, head: FileHead, asked: Mapping[Place, Field]) -> None:
        super().__init__(sentence)
        self.head, self.asked = head, dict(asked)


class SpectrumFound(df.ResultError):
    """A file is a thermal spectrum, not a curve."""


def curve_from(
    data: bytes, name: str, settings: Mapping[str, object], case: df.Case | None, folder: Path
) -> xr.Dataset:
    """Return the measured curve in the bytes of a file, before its calibration. Blocking.

    Parameters
    ----------
    data, name
        The file, and its name.
    settings
        Settings for reading and calibrating it: the keys of a table `[data]`.
    case
        The instrument, where there is one.
    folder
        A folder for the file while it is read.

    Raises
    ------
    MissingAnswer
        When the file lacks necessary information.
    DForceError
        When it has no curve.
    """
    if len(data) > MOST_BYTES:
        raise df.ResultError(f"{name} has more than {MOST_BYTES // 1_000_000} MB, too many for a curve")
    with _as_file(data, folder) as path:
        try:
            raw = df.read_measured(path, **_reading(settings))
            calibrated(raw, settings, case)
        except df.DForceError as error:
            sentence = str(error).replace(in_quotes(path), name)
            head = _head(data, name)
            if head is not None and head.kind == SPECTRUM:
                raise SpectrumFound(sentence) from None
            asked = dict(_questions(sentence, case)) if isinstance(error, df.ParameterError) else {}
            if head is not None and (asked or OF_THE_TABLE.search(sentence)):
                remedy = "; check the unit below" if "has no unit" in sentence else ""
                raise MissingAnswer(ADVICE.sub(remedy, sentence), head, asked) from None
            raise type(error)(sentence) from None
    return raw.assign_attrs(source=name)


@contextlib.contextmanager
def _as_file(data: bytes, folder: Path) -> Iterator[Path]:
    """Give a file with these bytes; a file of dForce itself is checked, any other HDF5 is read by a subprocess."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix="upload-") as place:
        path = Path(place) / "measured"
        path.write_bytes(data)
        if is_sealed(data):
            hdf5.look(data, "result")
        yield path


def calibrated(raw: xr.Dataset, settings: Mapping[str, Any], case: df.Case | None) -> xr.Dataset:
    """Return a curve calibrated for an instrument; a calibrated curve stays as it is.

    Raises
    ------
    ParameterError
        When the curve lacks necessary information.
    """
    if CALIBRATED in raw.attrs:
        return raw
    return df.calibrate(raw, case, **known_settings(df.calibrate, {}, settings.get("calibrate", {}), "calibrate"))


def script_of(curve: MeasuredData, picture: str, fits: str = "") -> str:
    """Return the lines of a script that draw a curve under the `result` of a `case`; none for a curve of dForce's own files.

    `fits` names a picture of the fit where the script fits the curve, too.

    Raises
    ------
    ParameterError
        For a setting that reading and calibrating do not take: no setting becomes code.
    """
    if Path(curve.name).suffix == ".nc":
        return ""
    read = _reading(curve.settings)
    settings = known_settings(df.calibrate, {}, curve.settings.get("calibrate", {}), "calibrate")
    more = "".join(f", {key}={value!r}" for key, value in settings.items())
    called = ", ".join([repr(curve.name), *(f"{key}={value!r}" for key, value in read.items())])
    lines = [f"measured = df.calibrate(df.read_measured({called}), case{more})"]
    if fits:
        lines += [
            "fit = df.fit(case, measured)",
            "print(df.fit_report(fit))",
            "print(df.chi2_in_words(fit))",
            f"df.plot.save(df.plot.fit(fit), {fits!r})",
        ]
    lines += [f'measured["height"] += {curve.shift!r}  # m'] * bool(curve.shift)
    if curve.turn:
        lines += [
            'for name in {"phase", "phase_2"} & set(measured):',
            f"    measured[name] -= {curve.turn!r}  # degrees",
        ]
    lines += [f"df.plot.save(df.plot.amplitude_phase(result, measured=measured), {picture!r})"]
    return "\n".join([*lines, ""])


def with_answers(settings: Mapping[str, object], places: Sequence[Place], answers: Sequence[str]) -> dict[str, Any]:
    """Return settings with answers; an empty answer changes nothing."""
    found: dict[str, Any] = copy.deepcopy(dict(settings))
    for place, answer in zip(places, answers, strict=True):
        if not answer.strip():
            continue
        *tables, key = place
        table = found
        for name in tables:
            table = table.setdefault(name, {})
        table[key] = int(answer) if key == "curve" and answer.isdecimal() else answer.strip()
    return found


def _reading(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of reading."""
    named = {name: settings.get(name) or None for name in SETTINGS[:3]}
    return known_settings(df.read_measured, named, settings.get("read", {}), "read")


def _head(data: bytes, name: str) -> FileHead | None:
    """Return the head of a file; None if it is not a table."""
    try:
        return head_of(tables_in(data, name), name)
    except df.ResultError:
        return None


def _questions(sentence: str, case: df.Case | None) -> Iterator[tuple[Place, Field]]:
    """Give the questions, besides the table's, that follow from a sentence of reader or calibration."""
    if (several := CURVES.search(sentence)) is not None:
        yield ("read", "curve"), text(f"Which curve, 1 to {several[1]}", "1")
    else:
        yield from _of_calibration(sentence, case)


def _of_calibration(sentence: str, case: df.Case | None) -> Iterator[tuple[Place, Field]]:
    """Give the questions for calibrating a curve."""
    noises = {"amplitude": "0.1 nm", "phase": "0.5 deg"}
    if "no free part" in sentence:
        amplitude = df.show(case.problem.tones[0].A0, "m") if case is not None else "10 nm"
        if "free_amplitude" in sentence:
            yield ("calibrate", "free_amplitude"), text("Free amplitude", amplitude)
        if "free_phase" in sentence:
            yield ("calibrate", "free_phase"), text("Phase of the free motion", "90 deg")
        for name, usual in noises.items():
            if f"errors of {name}" in sentence:
                yield ("calibrate", "errors", name), text(f"Noise of the {name}", usual)
    elif (noiseless := NOISELESS.search(sentence)) is not None:
        yield ("calibrate", "errors", noiseless[1]), text(f"Noise of the {noiseless[1]}", noises.get(noiseless[1], ""))


ROWS = 5  # of the head
MOST_POINTS = 300  # of the small curve
NEEDED = ("height", "amplitude", "phase")
CONVENTION, SENSITIVITY = ("phase_convention",), ("read", "sensitivity")
AMPLITUDE_IS, HEIGHT_GROWS = ("read", "amplitude_is"), ("read", "height_grows")


class TableForm(ui.element, component="table_form.js"):
    """The content of the dialog."""


def ask_table(
    title: str,
    why: str,
    head: FileHead,
    settings: Mapping[str, Any],
    more: Mapping[Place, Field],
    read: Callable[[dict[str, Any]], Awaitable[None]],
) -> None:
    """Ask how to read a table, and call `read` with the settings of `[data]`.

    Parameters
    ----------
    title, why
        Above the table: the name of the file, and a sentence on the missing or wrong information.
    head
        The columns, with their guesses.
    settings
        The answers so far, as keys of a table `[data]`.
    more
        Further questions, by the places of their answers.
    """
    with dialog(title, "df-table-dialog") as made:
        form = TableForm()
        form.props.update(title=title, why=why, **_shown(head, settings, more))

    async def answered(event: GenericEventArguments) -> None:
        made.close()
        await read(with_choices(head, settings, list(more), event.args))

    form.on("read", answered)
    form.on("cancel", made.close)


def _shown(head: FileHead, settings: Mapping[str, Any], more: Mapping[Place, Field]) -> dict[str, Any]:
    """Return the properties of the form: guesses, and over them the answers so far."""
    named = {name: quantity for quantity, name in dict(settings.get("columns") or {}).items()}
    units, read = dict(settings.get("units") or {}), dict(settings.get("read") or {})
    columns: list[dict[str, Any]] = []
    for one in head.columns:
        role = named.get(head.name_of(one), one.quantity if one.quantity not in named.values() else "")
        columns.append(
            {
                "name": one.name,
                "unit": _unit(one, role),
                "volts": is_of(one.unit or "", "V"),
                "typed": str(units.get(role) or UNITS.get(role, "nm")),
                "role": role,
                "sure": one.sure and role == one.quantity,
                "numbers": _few(one),
                "cells": [row[len(columns)] for row in head.rows(ROWS)],
            }
        )
    return {
        "columns": columns,
        "needed": list(NEEDED),
        "phases": PHASES,
        "convention": str(settings.get("phase_convention") or head.phase_convention or ""),
        "heights": HEIGHTS,
        "grows": str(read.get("height_grows") or head.height_grows or ""),
        "amplitudes": AMPLITUDES,
        "amplitude": str(read.get("amplitude_is") or head.amplitude_is or ""),
        "sensitivity": str(read.get("sensitivity") or ""),
        "piezo": str(units.get("height") or ""),
        "more": [{**field, "value": _answered(settings, place) or field["value"]} for place, field in more.items()],
    }


def _unit(column: HeadColumn, role: str) -> str:
    """Return the unit in a column's heading; empty where it has none, or the unit of something else, which a person types."""
    stored = MEANINGS[role].unit if role in NEEDED else ""
    fits = (
        not column.unit or not stored or is_of(column.unit, stored) or (role == "amplitude" and is_of(column.unit, "V"))
    )
    return (column.unit or "") if fits else ""


def _answered(settings: Mapping[str, Any], place: Place) -> str:
    """Return the setting at a place as text; empty where there is none."""
    found: Any = settings
    for key in place:
        found = found.get(key) if isinstance(found, Mapping) else None
    return "" if found is None else str(found)


def _few(column: HeadColumn) -> list[float | None]:
    """Return the numbers of a column for the small curve; empty for words."""
    if column.values.dtype.kind != "f":
        return []
    step = -(-len(column.values) // MOST_POINTS)
    return [float(value) if np.isfinite(value) else None for value in column.values[::step]]


def with_choices(
    head: FileHead, settings: Mapping[str, Any], more: Sequence[Place], answer: Mapping[str, Any]
) -> dict[str, Any]:
    """Return settings with a person's choices, without choices that a reader makes by itself."""
    found = copy.deepcopy(dict(settings))
    found.pop("columns", None)
    found.pop("units", None)
    roles = [str(role) for role in answer["roles"]]
    for one, role, unit in zip(head.columns, roles, answer["units"], strict=True):
        if not role or roles.count(role) > 1:
            continue
        if not (one.sure and role == one.quantity):
            found.setdefault("columns", {})[role] = head.name_of(one)
        if not _unit(one, role) and role in NEEDED and str(unit).strip():
            found.setdefault("units", {})[role] = str(unit).strip()[:LONGEST]
    places: list[Place] = [CONVENTION, *more]
    answers = [str(answer["convention"]), *map(str, answer["more"])]
    grows, amplitude = str(answer["grows"]), str(answer["amplitude"])
    if grows == "toward" or grows != head.height_grows:
        places, answers = [*places, HEIGHT_GROWS], [*answers, grows]
    if amplitude and amplitude != head.amplitude_is:
        places, answers = [*places, AMPLITUDE_IS], [*answers, amplitude]
    if str(answer["sensitivity"]).strip():
        places, answers = [*places, SENSITIVITY], [*answers, str(answer["sensitivity"])]
    return with_answers(found, places, [text[:LONGEST] for text in answers])


SENSITIVITIES = {"static": "by a force curve on a hard sample", "mode": "for this mode itself"}
TUNE_UNITS = {"temperature": "degC", "sensitivity": "nm/V"}  # of numbers alone: 25 is a room, not 25 K
TUNE_SETTINGS = ("temperature", "calibrated", "unit", "sensitivity")  # of df.thermal_tune


def tune_from(data: bytes, name: str, answers: Mapping[str, str], folder: Path) -> df.ThermalTune:
    """Return the thermal tune of a spectrum in the bytes of a file; `answers` are settings of `df.thermal_tune`. Blocking.

    Raises
    ------
    DForceError
        With one sentence.
    """
    with _as_file(data, folder) as path:
        try:
            given = {key: answers[key] for key in TUNE_SETTINGS if key in answers}
            told: dict[str, Any] = {key: composed(one, TUNE_UNITS.get(key, "")) for key, one in given.items()}
            return df.thermal_tune(path, **told)
        except df.DForceError as error:
            raise type(error)(str(error).replace(in_quotes(path), name)) from None


def tune_questions(wrong: str, answers: Mapping[str, str]) -> dict[str, Field]:
    """Return the questions on a spectrum by setting: from a sentence, and how the sensitivity was calibrated."""
    found = {
        "temperature": text("Temperature", answers.get("temperature", "25 degC")),
        "calibrated": choice("Sensitivity calibrated", SENSITIVITIES),
    }
    if "write unit" in wrong:
        found["unit"] = text("Unit of the density", "pm/sqrt(Hz)")
    if "sensitivity =" in wrong or "sensitivity" in answers:
        found["sensitivity"] = text("Sensitivity of the detector", answers.get("sensitivity", "50 nm/V"))
    return found
