"""A thermal spectrum that is dropped on the window: f0, k and Q of the lever, with their errors."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import dforce as df
from dforce.core.files import in_quotes
from dforce.gui.document.document import Document
from dforce.gui.files.saving import Field, choice, text
from dforce.inverse.values import show
from dforce.results import hdf5
from dforce.results.files import is_sealed

CALIBRATED = {"static": "by a force curve on a hard sample", "mode": "for this mode itself"}
UNITS = {"f0": "Hz", "k": "N/m", "Q": "1"}
KEYS = ("temperature", "calibrated", "unit", "sensitivity")  # of df.thermal_tune


def tune_from(data: bytes, name: str, answers: Mapping[str, str], folder: Path) -> df.ThermalTune:
    """Return the thermal tune of a spectrum in the bytes of a file; `answers` are settings of `df.thermal_tune`. Blocking.

    Raises
    ------
    DForceError
        With one sentence.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix="upload-") as place:
        path = Path(place) / "spectrum"
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


def in_words(tune: df.ThermalTune) -> str:
    """Return the values of a tune for a sentence."""
    return ", ".join(f"{name} = {show(*pair, UNITS[name])}" for name, pair in tune.as_table().items()) + "."


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
