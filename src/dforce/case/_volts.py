"""Amplitudes typed in volts, as the detector shows them: made lengths by its sensitivity before a case is read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dforce.core import units
from dforce.core.errors import ParameterError, UnitError
from dforce.instrument import Readout, beam


def without_volts(given: Mapping[str, object]) -> Mapping[str, Any]:
    """Return the tables of a case with free amplitudes in volts converted to meters.

    The sensitivity `readout.invols` holds for a steady force. An optical lever reads amplitudes with it: the length is the
    detector's. If the read-out is the deflection itself, the length is divided by a ratio of sensitivities: to the tone's own
    mode over a steady force. It is 1.09 for the first mode of a beam.

    Raises
    ------
    ParameterError
        When an amplitude is in volts and the sensitivity is missing.
    """
    drive = given.get("drive")
    if not isinstance(drive, Mapping):
        return given
    drive = {**drive}
    readout = given.get("readout")
    if "A0" in drive:
        drive["A0"] = _length(drive["A0"], drive.get("mode"), 1, readout, "drive.A0")
    tones = drive.get("tones")
    if isinstance(tones, list | tuple):
        drive["tones"] = [
            {**tone, "A0": _length(tone["A0"], tone.get("mode"), place, readout, f"drive.tones.{place}.A0")}
            if isinstance(tone, Mapping) and "A0" in tone
            else tone
            for place, tone in enumerate(tones, start=1)
        ]
    return {**given, "drive": drive}


def _length(given: object, mode: object, place: int, readout: object, path: str) -> Any:
    """Return an amplitude (m) that was typed in volts; anything else as it is."""
    volts = _volts(given)
    if volts is None:
        return given
    if isinstance(readout, Mapping):
        readout = Readout(**readout)
    if not isinstance(readout, Readout) or readout.invols is None:
        raise ParameterError(f'{path} is in volts: also write the sensitivity, such as readout.invols = "60 nm/V"')
    length = volts * readout.invols
    if readout.kind == "optical_lever" and readout.calibrated == "static":
        return length
    number = mode if isinstance(mode, int) and mode >= 1 else place
    own = readout.mode_sensitivity[number - 1] if len(readout.mode_sensitivity) >= number else beam.lever_factor(number)
    return length / abs(own)


def _volts(given: object) -> float | None:
    """Return text in volts as a number; None for anything else."""
    if not isinstance(given, str):
        return None
    parts = units.split_unit(given)
    if parts is None or not parts[1] or units.QUICK.get(parts[1], ("V",))[0] != "V":
        return None
    try:
        return units.parse(given, "V")
    except UnitError:
        return None
