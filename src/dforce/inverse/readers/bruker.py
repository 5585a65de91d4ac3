"""Text that Bruker's NanoScope exports: ``Height_Sensor_nm_Ex`` beside ``Height_Sensor_nm_Rt``."""

from __future__ import annotations

import re

from dforce.inverse.readers.text import beginning, read_text
from dforce.inverse.table import Reader

SIGNS = re.compile(r"\b(?:calc_ramp|height_sensor)_\w*(?:ex|rt)\b", re.IGNORECASE)
NANOSCOPE = "is a file of Bruker's NanoScope; export the curve as text (ASCII)"


READER = Reader(
    kind="text of Bruker's NanoScope",
    maker="Bruker",
    endings=(".txt",),
    is_one=lambda content: SIGNS.search(beginning(content)) is not None,
    read=read_text,
    amplitude_by_version=True,
    not_read={b"\\*File list": NANOSCOPE, b"\\*Force file list": NANOSCOPE},
    how="`..._Ex` and `..._Rt` side by side",
    seen="no: headings from published exports of force curves",
    export=(
        "**Bruker (NanoScope Analysis).** Export the curve as ASCII with both *Extend* and *Retract* and with units in the "
        "headings. Amplitudes are rms or zero to peak by version, so dForce asks for `amplitude_is`: compare the free "
        "amplitude "
        "with your setting."
    ),
)
