"""Lever and tip of a measured curve: a person confirms them before a fit, and each fitted value names them.

A curve is fitted as well with another spring constant or tip radius, by other values of the sample: no check of the fit finds
the mistake.
"""

from __future__ import annotations

import functools
import math
import tempfile
from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import Any

import dforce as df
from dforce.core.files import in_quotes
from dforce.core.units import show
from dforce.gui.document.document import Document, Path
from dforce.gui.window.dialogs import Field, choice, text
from dforce.inverse.values import show as show_with_error
from dforce.results import hdf5
from dforce.results.files import is_sealed

DIGITS = 6
UNCONFIRMED = (
    "Confirm lever and tip: with wrong values the fit looks as good, but its results are wrong. Choose a lever, type its "
    "values, or drop a thermal spectrum; then confirm."
)
TYPED = {"f0": "Hz", "k": "N/m", "Q": "1", "R": "m"}  # units of what is typed of lever and tip
LONGEST = 40  # characters of a value


def lever_and_tip(case: df.Case) -> dict[str, str]:
    """Return the values that a fit takes for exact, as text: f0, k and Q of each mode, then the shape of the tip."""
    found: dict[str, str] = {}
    modes = case.problem.modes
    for number, mode in enumerate(modes, start=1):
        ending = "" if len(modes) == 1 else f" of mode {number}"
        found |= {
            f"f0{ending}": show(mode.f0, "Hz", DIGITS),
            f"k{ending}": show(mode.k, "N/m", DIGITS),
            f"Q{ending}": f"{mode.Q:.{DIGITS}g}",
        }
    if case.tip is not None and case.tip.radius is not None:
        found["R"] = show(case.tip.radius, "m", DIGITS)
    if case.tip is not None and case.tip.half_angle is not None:
        found["half-angle"] = show(case.tip.half_angle, "deg", DIGITS)
    return found


def asked(document: Document) -> dict[str, str]:
    """Return the lever and the tip that a document has; empty while it is not a case."""
    try:
        return lever_and_tip(document.case())
    except (df.DForceError, TypeError):
        return {}


def missing(document: Document) -> str:
    """Return why a document has no lever and tip; empty where it has them."""
    try:
        document.case()
    except (df.DForceError, TypeError) as error:
        return str(error)
    return ""


def place_of(document: Document, name: str) -> Path:
    """Return where a value of lever or tip is typed; () where it follows from others, as of a beam."""
    if name == "R":
        return ("tip", "radius")
    if document.value(("cantilever", "beam")):
        return ()
    return ("cantilever", "modes", 0, name) if document.value(("cantilever", "modes")) else ("cantilever", name)


def typed(document: Document) -> list[dict[str, str]]:
    """Return the values of lever and tip that can be typed, each with its name and its text."""
    values = asked(document)
    found = []
    for name in TYPED:
        place = place_of(document, name)
        if place:
            text = document.value(place)
            found.append({"name": name, "text": str(text if text is not None else values.get(name, ""))})
    return found


def with_value(document: Document, name: str, text: str) -> Document:
    """Return a document with a value of lever or tip as typed; nothing typed takes it away."""
    place = place_of(document, name) if name in TYPED else ()
    return document.put(place, text.strip()[:LONGEST] or None) if place else document


def with_library(document: Document, name: str) -> Document:
    """Return a document with a lever of the library, and with its tip where the library has one.

    Its Q is that of the medium, or must be typed: few makers state one.
    """
    probe = df.cantilevers().get(name)
    if probe is None:
        return document
    document = document.put(("cantilever",), {"name": name})
    if probe.tip_radius is not None:
        document = document.put(("tip", "radius"), show(probe.tip_radius, "m", DIGITS))
    return document


def is_confirmed(document: Document, values: dict[str, str]) -> bool:
    """Return whether these values were confirmed for the measured curve of a document."""
    return document.measured is not None and bool(values) and dict(document.measured.confirmed) == values


def in_words(values: dict[str, str]) -> str:
    """Return values for a sentence: ``k = 2.7 N/m, R = 8 nm``."""
    return ", ".join(f"{name} = {value}" for name, value in values.items())


@functools.lru_cache(maxsize=16)
def holds_for(case: str, fitted: tuple[str, ...] = ()) -> str:
    """Return for which k and R the values of a fit hold, from its case as text; without a value that was fitted itself."""
    try:
        values = lever_and_tip(df.Case.from_toml(case))
    except df.DForceError:
        return ""
    free = {"k" if path.endswith(".k") else "R" for path in fitted if path.endswith((".k", "tip.radius"))}
    kept = {name: value for name, value in values.items() if name[0] in {"k", "R"} - free}
    return f"for {in_words(kept)}" if kept else ""


CALIBRATED = {"static": "by a force curve on a hard sample", "mode": "for this mode itself"}
UNITS = {"f0": "Hz", "k": "N/m", "Q": "1"}
KEYS = ("temperature", "calibrated", "unit", "sensitivity")  # of df.thermal_tune


def tune_from(data: bytes, name: str, answers: Mapping[str, str], folder: FilePath) -> df.ThermalTune:
    """Return the thermal tune of a spectrum in the bytes of a file; `answers` are settings of `df.thermal_tune`. Blocking.

    Raises
    ------
    DForceError
        With one sentence.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix="upload-") as place:
        path = FilePath(place) / "spectrum"
        path.write_bytes(data)
        if is_sealed(data):
            hdf5.look(data, "result")
        try:
            told: dict[str, Any] = {key: answers[key] for key in KEYS if key in answers}
            return df.thermal_tune(path, **told)
        except df.DForceError as error:
            raise type(error)(str(error).replace(in_quotes(path), name)) from None


def questions(wrong: str, answers: Mapping[str, str]) -> dict[str, Field]:
    """Return what is asked of a spectrum, by setting: what a sentence asks for, and how the sensitivity was calibrated."""
    found = {
        "temperature": text("Temperature", answers.get("temperature", "25 degC")),
        "calibrated": choice("Sensitivity calibrated", CALIBRATED),
    }
    if "write unit" in wrong:
        found["unit"] = text("Unit of the density", "pm/sqrt(Hz)")
    if "sensitivity =" in wrong or "sensitivity" in answers:
        found["sensitivity"] = text("Sensitivity of the detector", answers.get("sensitivity", "50 nm/V"))
    return found


def tune_in_words(tune: df.ThermalTune) -> str:
    """Return the values of a tune for a sentence."""
    return ", ".join(f"{name} = {show_with_error(*pair, UNITS[name])}" for name, pair in tune.as_table().items()) + "."


def with_lever(document: Document, tune: df.ThermalTune) -> Document:
    """Return a document whose lever has the values of a tune; the error of k counts in a fit."""
    modes = bool(document.value(("cantilever", "modes")))
    base = ("cantilever", "modes", 0) if modes else ("cantilever",)
    for name, (value, error) in tune.as_table().items():
        digits = 2 + max(0, math.floor(math.log10(value)) - math.floor(math.log10(error)))  # two of the error
        text = df.show(value, UNITS[name], digits)
        document = document.put((*base, name), text if name != "Q" else float(text))
    path = "cantilever.modes.1.k" if modes else "cantilever.k"
    return document.put(("fit", "given", path), [tune.k, tune.k_error])
