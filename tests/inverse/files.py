"""Files of instruments, made by ourselves: writers that only tests need."""

from __future__ import annotations

import struct

import numpy as np


def igor_wave(columns, note="", order="<"):
    """Return a binary wave (version 5) of named channels, as Asylum's software writes force curves.

    Made after the layout of WaveMetrics' Technical Note 003: a header of the file, a header of the wave, the numbers, the
    note, and the labels of the columns (the first label is that of the dimension itself).
    """
    names, values = list(columns), np.stack(list(columns.values()), axis=1)
    rows, count = values.shape
    data = np.asfortranarray(values, dtype=f"{order}f4").tobytes("F")
    text = note.encode("cp1252")
    labels = b"".join(name.encode().ljust(32, b"\0") for name in ["", *names])
    wave = struct.pack(f"{order}III", 0, 0, 0)  # next wave, created, modified
    wave += struct.pack(f"{order}ihh", rows * count, 2, 0) + b"\0" * 6 + struct.pack(f"{order}h", 1)
    wave += b"curve".ljust(32, b"\0") + struct.pack(f"{order}iI", 0, 0)
    wave += struct.pack(f"{order}4i", rows, count, 0, 0)
    wave += struct.pack(f"{order}4d", 1.0, 1.0, 1.0, 1.0) + struct.pack(f"{order}4d", 0.0, 0.0, 0.0, 0.0)
    wave = wave.ljust(320, b"\0")
    sizes = struct.pack(f"{order}i", 0) + struct.pack(f"{order}i", len(text)) + struct.pack(f"{order}i", 0)
    sizes += struct.pack(f"{order}4i", 0, 0, 0, 0) + struct.pack(f"{order}4i", 0, len(labels), 0, 0)
    sizes += struct.pack(f"{order}3i", 0, 0, 0)
    head = struct.pack(f"{order}hh", 5, 0) + struct.pack(f"{order}i", 320 + len(data)) + sizes
    checksum = -int(np.frombuffer(head + wave, f"{order}i2").sum(dtype=np.int64)) & 0xFFFF
    head = struct.pack(f"{order}hH", 5, checksum) + head[4:]
    return head + wave + data + text + labels


def nanosurf(curves, units, heights=("Z-Axis", "m"), lines=None, frames=("Spec forward", "Spec backward")):
    """Return a .nid file: for each direction the channels by name, each an array (lines, points).

    The heights are equal steps between the first and the last of the commanded ones, given as ``(low, range)``.
    """
    text = ["[DataSet]", "Version=2", f"GroupCount={len(curves)}"]
    sections, blocks = [], b""
    for group, ((low, span), channels) in enumerate(curves):
        text += [f"Gr{group}-Name={frames[group]}", f"Gr{group}-ID=1", f"Gr{group}-Count={len(channels)}"]
        for number, (name, values) in enumerate(channels.items()):
            text.append(f"Gr{group}-Ch{number}=DataSet-{group}:{number}")
            rows, points = values.shape
            bottom, width = float(values.min()) - 1e-12, float(np.ptp(values)) + 2e-12
            sections += [
                f"[DataSet-{group}:{number}]", "Version=3", f"Points={points}", f"Lines={rows}", f"Frame={frames[group]}",
                f"CurLine={rows - 1}", f"Dim0Name={heights[0]}", f"Dim0Unit={heights[1]}", f"Dim0Range={span!r}",
                f"Dim0Min={low!r}", "Dim1Name=SpecPoint", f"Dim2Name={name}", f"Dim2Unit={units[name]}",
                f"Dim2Range={width!r}", f"Dim2Min={bottom!r}", "SaveMode=Binary", "SaveBits=32", "SaveSign=Signed",
                "SaveOrder=Intel", "",
            ]  # fmt: skip
            for row, kept in enumerate(lines or ()):
                sections.insert(-1, f"LineDim{row}Points={kept}")
            share = np.round((values - bottom) / width * 2.0**32 - 2.0**31)
            blocks += np.clip(share, -(2.0**31), 2.0**31 - 1).astype("<i4").tobytes()
    info = ["", "[DataSet-Info]", "Spring Constant:=2.00 N/m", "Head type=FlexAFM", ""]
    return "\r\n".join([*text, *info, *sections, ""]).encode() + b"#!" + blocks
