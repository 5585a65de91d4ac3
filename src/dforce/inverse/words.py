"""The words of instruments: which column holds which quantity, and in which unit."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import NamedTuple

from dforce.core import units
from dforce.core.errors import UnitError


class Meaning(NamedTuple):
    """A quantity of a measured curve: its stored unit (in the spelling of dForce's units), and names for it."""

    unit: str
    names: tuple[str, ...]


# names are compared without capitals, spaces and signs
MEANINGS = {
    "height_sensor": Meaning("m", (
        "zsnsr", "zsensor", "zaxissensor", "heightsensor", "sensorheight", "heightmeasured", "measuredheight", "height(sensor)",
        "heightmeasuredsmoothed", "capacitivesensorheight", "smoothedcapacitivesensorheight", "straingaugeheight",
        "smoothedstraingaugeheight", "sensor", "zmeasured",
    )),
    "height_piezo": Meaning("m", (
        "raw", "piezo", "zpiezo", "piezoz", "heightpiezo", "piezoheight", "calcramp", "ramp", "zaxis", "heightcommanded",
        "zcommand",
    )),
    "height": Meaning("m", ("height", "z", "zc", "zposition", "heightabovesample", "höhe", "hauteur")),
    "amplitude": Meaning("m", (
        "amplitude", "amp", "ampl", "amplitude1", "amp1", "amplitudetone1", "lockinamplitude", "a", "a1",
    )),
    "phase": Meaning("degree", ("phase", "ph", "phaselag", "phase1", "phasetone1", "phi", "phi1", "lockinphase", "phaseangle")),
    "amplitude_2": Meaning("m", ("amplitude2", "amp2", "amplitudetone2", "a2")),
    "phase_2": Meaning("degree", ("phase2", "phasetone2", "phi2")),
    "deflection": Meaning("m", ("deflection", "defl", "verticaldeflection", "vdeflection", "meandeflection")),
    "frequency": Meaning("Hz", ("frequency", "drivefrequency", "freq")),
    "frequency_shift": Meaning("Hz", ("frequencyshift", "df", "deltaf", "freqshift")),
    "excitation": Meaning("", ("excitation", "drive", "driveamplitude", "dissipation", "drivevoltage")),
    "time": Meaning("s", ("time", "t", "segmenttime", "seriestime", "times")),
    "branch": Meaning("1", ("branch",)),
    "direction": Meaning("", ("direction", "segment")),
    "curve": Meaning("1", ("curve", "curvenumber", "curveindex")),
    "x": Meaning("m", ("x", "xposition", "posx")),
    "y": Meaning("m", ("y", "yposition", "posy")),
}  # fmt: skip
DENSITY = (  # names of the density in a spectrum
    "psd", "powerspectraldensity", "amplitudespectraldensity", "asd", "density", "spectraldensity", "power", "spectrum",
)  # fmt: skip
ABOVE_THE_SAMPLE = ("zc", "heightabovesample")  # names of heights that are larger farther away
OF_A_NAME = {name: quantity for quantity, meaning in MEANINGS.items() for name in meaning.names}
# units that may end a name behind an underscore or a slash; any other word there belongs to the name
ENDINGS = (
    "m", "mm", "um", "µm", "μm", "nm", "pm", "A", "Å", "V", "mV", "uV", "µV", "μV", "deg", "Deg", "degree", "degrees", "°",
    "rad", "mrad", "Hz", "kHz", "MHz", "s", "ms", "us", "N", "nN", "pN", "%",
)  # fmt: skip
SPELLED = {"°": "deg", "º": "deg", "A": "angstrom", "Å": "angstrom", "arb": "", "none": "", "-": ""}
SPELLED |= dict.fromkeys(("Deg", "DEG", "degrees", "Degree", "Degrees", "Grad", "grad", "degrés"), "deg")
TO_PEAK = {
    "peak": 1.0,
    "rms": math.sqrt(2.0),
    "peak-to-peak": 0.5,
}  # factors from the kinds of amplitudes to zero to peak
PEAK_TO_PEAK = ("peaktopeak", "pkpk", "pp")  # ends of names
TO_ZERO = ("rms", "zerotopeak", "0peak", "0pk", "peak", "pk")
KIND = re.compile(
    r"[\W_]*(rms|(peak[\W_]*to[\W_]*|0[\W_]*)?peak|((pk|0)[\W_]*)?pk|p[\W_]*p)\W*$", re.IGNORECASE
)  # of a unit
LONGEST_HEADING = 200  # characters; a longer text is a name without a unit
BRACKETS = re.compile(r"^(.*?)\s*(?:\[([^\[\]]*)\]|\(((?:[^()]|\([^()]*\))*)\))\s*$", re.DOTALL)


def bare(name: str) -> str:
    """Return a name without capitals, spaces and signs, which do not distinguish names."""
    return "".join(sign for sign in name.casefold() if sign.isalnum())


def known_unit(text: str) -> str | None:
    """Return a unit in the spelling of dForce's units, None for text that is no unit; the empty text for "no unit"."""
    if len(text) > units.LONGEST_UNIT:
        return None
    text = text.strip().replace("μ", "u").replace("µ", "u")
    text = SPELLED.get(text, text)
    text = re.sub(r"(?:sqrt|rt|√)\s*\(?\s*Hz\s*\)?|Hz\s*(?:½|\^\s*\(?1/2\)?)", "Hz^0.5", text).replace("²", "^2")
    if not text:
        return ""
    try:
        units.unit_scale(text)
    except UnitError:
        return None
    return text


def split_heading(heading: str) -> tuple[str, str | None]:
    """Return the name and the unit of a column's heading: ``Phase [deg]``, ``Amp (nm)``, ``height_nm`` or ``z / nm``.

    The unit is None where the heading has none.
    """
    heading = heading.strip().strip('"').strip()
    name, inside = _in_brackets(heading)
    if amplitude_kind(inside):  # the name keeps it: Amp (Vrms), amplitude [nm pk-pk]
        return heading, known_unit(KIND.sub("", inside)) or None
    if name and inside and (unit := known_unit(inside)) is not None:
        return name, unit
    for name, sign, last in (heading.rpartition("_"), heading.rpartition(" / "), heading.rpartition("/")):
        if name and last in ENDINGS and not (sign == "/" and " " in name):  # "sensitivity nm/V" ends in one unit
            return name.strip(), known_unit(last)
    return heading, None


def _in_brackets(heading: str) -> tuple[str, str]:
    """Return the parts of a heading before and in its last brackets; without brackets, the heading."""
    match = BRACKETS.match(heading) if len(heading) <= LONGEST_HEADING else None
    return (match[1].strip(), (match[2] or match[3] or "").strip()) if match else (heading, "")


def quantity_of(name: str, names: Mapping[str, str] | None = None) -> str | None:
    """Return the quantity that a column of this name has, by a maker's own names first; None for an unknown name."""
    before, inside = _in_brackets(name)
    word = re.sub(rf"({'|'.join((*PEAK_TO_PEAK, *TO_ZERO))})$", "", bare(before if amplitude_kind(inside) else name))
    return (names or {}).get(word) or OF_A_NAME.get(word)


def amplitude_kind(name: str) -> str | None:
    """Return the key of :data:`TO_PEAK` that the name or the unit of an amplitude ends in, if any."""
    word = bare(name)
    if word.endswith(PEAK_TO_PEAK):
        return "peak-to-peak"
    return next((kind for end, kind in (("rms", "rms"), ("peak", "peak"), ("pk", "peak")) if word.endswith(end)), None)


def scale_to(unit: str, stored: str) -> float:
    """Return the factor from `unit` to `stored`; either may be "degree".

    Raises
    ------
    UnitError
        When the two measure different things.
    """
    if stored == "degree":
        return 1.0 if unit in ("deg", "degree") else math.degrees(units.parse(f"1 {unit}", "rad"))
    return units.parse(f"1 {unit}", stored)


def is_of(unit: str, stored: str) -> bool:
    """Return whether a unit has the dimension of another."""
    try:
        scale_to(unit, stored)
    except UnitError:
        return False
    return True


def naming(quantity: str) -> str:
    """Return how to name the column of a quantity, for a sentence."""
    return f"columns = {{'{quantity}': ...}}, or --columns {quantity}=... in a terminal"
