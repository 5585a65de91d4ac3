"""Text files of measured curves: what programs write, and what becomes of files that are damaged."""

from __future__ import annotations

import measured_curve
import numpy as np
import pytest
from every import every

import dforce as df
from dforce.inverse.readers import text

HEIGHT, AMPLITUDE, LAG = measured_curve.numbers()
SHARED = ("stiff", "air", "liquid")


def read(tmp_path, content, name="curve.csv", **how):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return df.read_measured(path, **how)


def is_the_curve(data):
    """Say whether a curve is the one written, within the digits of the file."""
    np.testing.assert_allclose(data.height, HEIGHT, atol=1e-13)
    np.testing.assert_allclose(data.amplitude, AMPLITUDE, atol=1e-14)
    np.testing.assert_allclose(data.phase, LAG, atol=1e-4)
    return True


@pytest.mark.parametrize(
    ("content", "name"),
    [
        (measured_curve.text(), "plain.csv"),
        (measured_curve.text(newline="\r\n"), "crlf.csv"),
        (measured_curve.text(newline="\r"), "cr.csv"),
        (measured_curve.text(";", ","), "decimal-commas.csv"),
        (measured_curve.text("\t", ","), "decimal-commas.tsv"),
        (measured_curve.text("\t"), "tabs.tsv"),
        (measured_curve.text("  "), "blanks.txt"),
        (measured_curve.text(" , "), "blanks-and-commas.csv"),
        ("\ufeff" + measured_curve.text(), "bom.csv"),
        (measured_curve.text().encode("utf-16"), "utf-16.csv"),
        (measured_curve.text().encode("utf-16-le"), "utf-16-without-a-mark.csv"),
        (measured_curve.text().encode("utf-16-be"), "utf-16-be-without-a-mark.csv"),
        (measured_curve.text(heading="Z sensor (nm),Amp [nm],Phase (°)").encode("cp1252"), "cp1252.csv"),
        (measured_curve.text(heading="Phase [deg],Height [nm],Amplitude [nm]").replace("Phase [deg],Height [nm],Amplitude [nm]",
         "Height [nm],Amplitude [nm],Phase [deg]"), "brackets.csv"),
        ("# a comment\n% another\n\n" + measured_curve.text(), "comments.csv"),
        (measured_curve.text().replace("height_nm,amplitude_nm,phase_deg", "# height_nm,amplitude_nm,phase_deg"), "hash.csv"),
        (measured_curve.text().replace("height_nm,amplitude_nm,phase_deg", "Height,Amplitude,Phase\nnm,nm,deg"), "units.csv"),
        (measured_curve.text().replace("height_nm,amplitude_nm,phase_deg", "Height,Amplitude,Phase\nnm,nm,deg\nz,r,theta"),
         "remarks.csv"),
        (measured_curve.text().replace("height_nm,amplitude_nm,phase_deg", "-,-,-\nheight_nm,amplitude_nm,phase_deg"),
         "dashes.csv"),
        (measured_curve.text().replace("\n", ",\n"), "trailing.csv"),
        (measured_curve.text() + "\n\n", "blank-lines.csv"),
        (measured_curve.text("\t").replace("\n", "\t\n").replace("deg\t", "deg"), "tabs-end-rows.txt"),
        (measured_curve.text("\t").replace("deg", "deg\t"), "a-tab-ends-the-headings.txt"),
        (measured_curve.text() + ",,\n" * 3, "rows-of-separators.csv"),
        (measured_curve.text().replace("height_nm", '"z (nm)"').replace("phase_deg", '"phase (deg)"'), "quotes.csv"),
        (measured_curve.text(";").replace("phase_deg", '"phase (deg)";"a;b"').replace("\n", ";1\n").replace('b";1', 'b"'),
         "quotes-around-a-separator.csv"),
        ("\n".join([measured_curve.text().partition("\n")[0], *(",".join(f'"{cell}"' for cell in line.split(";"))
         for line in measured_curve.text(";", ",").splitlines()[1:]), ""]), "quotes-around-decimal-commas.csv"),
        ("\n".join(line.replace(",", ",,", 1) for line in measured_curve.text().split("\n")).replace(",,", ",defl_nm,", 1),
         "an-empty-column.csv"),
    ],
    ids=lambda value: value if isinstance(value, str) and len(value) < 30 else "",
)  # fmt: skip
def test_a_table_is_read_whatever_program_wrote_it(tmp_path, content, name):
    assert is_the_curve(read(tmp_path, content, name))


@pytest.mark.parametrize("name", SHARED)
def test_the_shipped_curves_are_read(name):
    from importlib import resources

    path = resources.files("dforce") / "library" / "measured" / f"{name}.csv"
    data = df.read_measured(str(path), phase_convention="lag")
    table = np.loadtxt(str(path), delimiter=",", skiprows=2)
    np.testing.assert_allclose(data.height, 1e-9 * table[:, 0], rtol=1e-12)
    np.testing.assert_allclose(data.amplitude, 1e-9 * table[:, 1], rtol=1e-12)
    np.testing.assert_array_equal(data.phase, table[:, 2])
    np.testing.assert_array_equal(data.branch, table[:, 3])
    assert set(data.direction.values) == {"approach"}


def test_what_was_done_stands_in_the_result(tmp_path):
    data = read(tmp_path, measured_curve.text(heading="Height (nm),Amplitude (nm),Phase (deg)"))
    said = data.attrs["history"]
    assert "height: column 'Height' in nm" in said
    assert any("zero to peak, the default" in line for line in said)
    assert data.attrs["phase_convention"] == "unknown"
    assert len(data.attrs["sha256"]) == 64 and data.attrs["source"] == "curve.csv"
    assert data.height.attrs["units"] == "m" and data.phase.attrs["units"] == "degree"


@pytest.mark.parametrize(
    ("convention", "turned"),
    [("lag", lambda lag: lag), ("lead", lambda lag: -lag), ("90-lag", lambda lag: 90 - lag), ("lag-90", lambda lag: lag - 90)],
)  # fmt: skip
def test_each_convention_of_the_phase_gives_the_same_lags(tmp_path, convention, turned):
    content = "height_nm,amplitude_nm,phase_deg\n" + "".join(
        f"{1e9 * h:.4f},{1e9 * a:.5f},{turned(phi):.4f}\n" for h, a, phi in zip(HEIGHT, AMPLITUDE, LAG, strict=True)
    )
    assert is_the_curve(read(tmp_path, content, phase_convention=convention))
    later = df.calibrate(read(tmp_path, content), phase_convention=convention)
    at_once = df.calibrate(read(tmp_path, content, phase_convention=convention))
    np.testing.assert_allclose(later.phase, at_once.phase, atol=1e-9)


def test_a_phase_that_wraps_is_joined(tmp_path):
    lag = (LAG + 95.0 + 180.0) % 360.0 - 180.0  # of an instrument with an offset, which counts from -180 to 180 degrees
    assert np.abs(np.diff(lag)).max() > 300.0
    content = "height_nm,amplitude_nm,phase_deg\n" + "".join(
        f"{1e9 * h:.4f},{1e9 * a:.5f},{phi:.4f}\n" for h, a, phi in zip(HEIGHT, AMPLITUDE, lag, strict=True)
    )
    data = df.calibrate(read(tmp_path, content, phase_convention="lag"))
    whole = df.calibrate(read(tmp_path, measured_curve.text(), phase_convention="lag"))
    np.testing.assert_allclose(data.phase, whole.phase, atol=1e-3)


def test_columns_and_units_may_be_said(tmp_path):
    content = measured_curve.text(heading="U,V,W")
    data = read(
        tmp_path, content, columns={"height": "U", "amplitude": "V", "phase": "W"},
        units={"height": "nm", "amplitude": "nm", "phase": "deg"},
    )  # fmt: skip
    assert is_the_curve(data)


def test_volts_need_a_sensitivity_and_rms_a_factor(tmp_path):
    content = measured_curve.text(heading="height_nm,amplitude_V,phase_deg")
    with pytest.raises(df.ParameterError, match=r"amplitude in V.*write the sensitivity"):
        read(tmp_path, content)
    data = read(tmp_path, content, sensitivity="50 nm/V")
    np.testing.assert_allclose(data.amplitude, 50e-9 * 1e9 * AMPLITUDE, atol=1e-12)
    rms = read(tmp_path, measured_curve.text(), amplitude_is="rms")
    np.testing.assert_allclose(rms.amplitude, np.sqrt(2.0) * AMPLITUDE, atol=1e-13)
    named = read(tmp_path, measured_curve.text(heading="height_nm,amplitude rms (nm),phase_deg"))
    np.testing.assert_allclose(named.amplitude, rms.amplitude)


def test_heights_in_volts_take_the_sensitivity_of_the_piezo(tmp_path):
    content = measured_curve.text(heading="Z (V),amplitude_nm,phase_deg")
    with pytest.raises(df.ParameterError, match="write the sensitivity of the piezo"):
        read(tmp_path, content)
    data = read(tmp_path, content, units={"height": "20 nm/V"})
    np.testing.assert_allclose(data.height, 20e-9 * 1e9 * HEIGHT, atol=1e-12)
    for wrong in ("-20 nm/V", "20 N/V", "bananas"):
        with pytest.raises(df.ParameterError, match="the sensitivity of the piezo"):
            read(tmp_path, content, units={"height": wrong})
    with pytest.raises(df.ParameterError, match="'20 nm/V' is not a known unit"):
        read(tmp_path, measured_curve.text(heading="Z,amplitude_nm,phase_deg"), units={"height": "20 nm/V"})


def test_each_line_of_a_long_file_is_taken_apart_once(tmp_path, monkeypatch):
    taken_apart, cells = [], text.Style.cells
    monkeypatch.setattr(text.Style, "cells", lambda self, line: taken_apart.append(line) or cells(self, line))
    lines = measured_curve.text().splitlines()
    assert is_the_curve(read(tmp_path, "\n".join(lines)))
    assert taken_apart.count(lines[len(lines) // 2]) == 1


def test_both_directions_are_told_apart_by_the_heights(tmp_path):
    down = measured_curve.text().splitlines()
    content = "\n".join([*down, *reversed(down[1:]), ""])
    data = read(tmp_path, content)
    assert (data.direction[:120] == "approach").all() and (data.direction[121:] == "retract").all()
    assert data.height[0] == data.height.max() and float(data.height[-1]) == float(data.height.max())


def test_a_column_of_directions_counts_and_their_order_is_the_walk(tmp_path):
    lines = measured_curve.text().splitlines()
    rows = [f"{row},{word}" for word in ("approach", "retract") for row in lines[1:]]  # both listed from far to near
    data = read(tmp_path, "\n".join([f"{lines[0]},direction", *rows, ""]))
    retract = data.where(data.direction == "retract", drop=True)
    assert (np.diff(retract.height) > 0.0).all()
    assert any("in reverse order" in line for line in data.attrs["history"])


def test_side_by_side_directions_of_nanoscope_are_read(tmp_path):
    """The headings are those of exports of force curves; channels of a lock-in stand beside them by the same rule."""
    rows = [
        f"{1e9 * h:.4f}\t{1e9 * back:.4f}\t{1e9 * a:.5f}\t{1e9 * b:.5f}\t{p:.4f}\t{q:.4f}"
        for h, back, a, b, p, q in zip(HEIGHT, HEIGHT[::-1], AMPLITUDE, AMPLITUDE[::-1], LAG, LAG[::-1], strict=True)
    ]
    rows[-1] = "\t".join(cell if place % 2 == 0 else "" for place, cell in enumerate(rows[-1].split("\t")))
    heading = "Height_Sensor_nm_Ex\tHeight_Sensor_nm_Rt\tAmplitude_nm_Ex\tAmplitude_nm_Rt\tPhase_Deg_Ex\tPhase_Deg_Rt"
    content = "\r\n".join([heading.replace("Deg", "deg"), *rows, ""])
    with pytest.raises(df.ParameterError, match=r"Bruker.*rms or zero to peak"):
        read(tmp_path, content, "curve.txt")
    data = read(tmp_path, content, "curve.txt", amplitude_is="peak")
    assert is_the_curve(data.where(data.direction == "approach", drop=True))
    assert (data.direction == "retract").sum() == 119  # its last cells are empty
    assert data.attrs["height_kind"] == "sensor"


def test_directions_side_by_side_may_share_their_heights(tmp_path):
    rows = [
        f"{1e9 * h:.4f},{1e9 * a:.5f},{1.01e9 * a:.5f},{p:.4f},{p + 1.0:.4f}"
        for h, a, p in zip(HEIGHT, AMPLITUDE, LAG, strict=True)
    ]
    heading = "Z (nm),Amp Trace (nm),Amp Retrace (nm),Phase Trace (deg),Phase Retrace (deg)"
    data = read(tmp_path, "\n".join([heading, *rows, ""]))
    assert is_the_curve(data.where(data.direction == "approach", drop=True))
    retract = data.where(data.direction == "retract", drop=True)
    np.testing.assert_allclose(retract.height[::-1], HEIGHT, atol=1e-13)
    np.testing.assert_allclose(retract.amplitude[::-1], 1.01 * AMPLITUDE, atol=1e-13)
    np.testing.assert_allclose(retract.phase[::-1], LAG + 1.0, atol=1e-3)


def test_in_phase_and_out_of_phase_are_no_directions(tmp_path):
    rows = [f"{1e9 * h:.4f},{a:.6e},{p:.4f}" for h, a, p in zip(HEIGHT, AMPLITUDE, LAG, strict=True)]
    path = tmp_path / "curve.csv"
    path.write_text("\n".join(["Z (nm),Signal in (m),Signal out (m)", *rows, ""]))
    assert [column.name for column in df.file_head(path).columns] == ["Z", "Signal in", "Signal out"]


def test_text_of_jpk_names_its_columns_in_comments(tmp_path):
    def block(word, order):
        rows = zip(HEIGHT[order], AMPLITUDE[order], LAG[order], strict=True)
        lines = [f"{h + 1e-7:.6e} {h:.8e} {a:.8e} {p:.4f}" for h, a, p in rows]
        return [
            f"# segment: {word}", "# columns: height measuredHeight lockInAmplitude lockInPhase",
            '# fancyNames: "Height" "Height (measured)" "Lock-In Amplitude" "Lock-In Phase"', "# units: m m m deg", *lines, "",
        ]  # fmt: skip

    whole, back = slice(None), slice(None, None, -1)
    content = "\n".join(["# springConstant: 2.7", "#", *block("extend", whole), *block("retract", back), ""])
    with pytest.raises(df.ParameterError, match=r"JPK.*rms or zero to peak"):
        read(tmp_path, content, "curve.txt")
    data = read(tmp_path, content, "curve.txt", amplitude_is="peak")
    assert is_the_curve(data.where(data.direction == "approach", drop=True))
    assert (data.direction == "retract").sum() == 120
    assert data.attrs["k"] == 2.7 and data.attrs["height_kind"] == "sensor"
    piezo = read(tmp_path, content, "curve.txt", amplitude_is="peak", height="piezo")
    np.testing.assert_allclose(piezo.height[:120], HEIGHT + 1e-7, atol=1e-13)


def test_curves_of_a_map_are_told_apart_by_their_places(tmp_path):
    lines = measured_curve.text().splitlines()
    rows = [f"{row},{x},{y}" for x, y in ((0, 0), (0, 5), (5, 0)) for row in lines[1:]]
    path = tmp_path / "map.csv"
    path.write_text("\n".join([f"{lines[0]},x_um,y_um", *rows, ""]))
    curves = df.read_curves(path)
    places = [(curve.attrs["x"], curve.attrs["y"]) for curve in curves]
    np.testing.assert_allclose(places, [(0, 0), (0, 5e-6), (5e-6, 0)], rtol=1e-12)
    assert [curve.attrs["curve"] for curve in curves] == [1, 2, 3]
    assert all(is_the_curve(curve) for curve in curves)
    with pytest.raises(df.ParameterError, match="contains 3 curves: choose one with curve = 1 to 3"):
        df.read_measured(path)
    assert df.read_measured(path, curve=2).attrs["y"] == places[1][1]
    with pytest.raises(df.ParameterError, match="has no curve 4; it contains 3"):
        df.read_measured(path, curve=4)


def changed(line, cell, value):
    """Return the table with another cell; lines count from 1, the headings' line included."""
    lines = measured_curve.text().splitlines()
    cells = lines[line - 1].split(",")
    cells[cell] = value
    lines[line - 1] = ",".join(cells)
    return "\n".join([*lines, ""])


def constant_height():
    """Return the table with one height for all points."""
    return "height_nm,amplitude_nm,phase_deg\n" + "".join(
        f"5,{1e9 * a:.5f},{phi:.4f}\n" for a, phi in zip(AMPLITUDE, LAG, strict=True)
    )


def shuffled():
    """Return the table with its rows in no order."""
    heading, *rows = measured_curve.text().splitlines()
    return "\n".join([heading, *np.random.default_rng(1).permutation(rows).tolist(), ""])


@every([
        ("", "is empty"),
        ("only words\nand more\n", "contains no table of numbers"),
        (changed(50, 1, "nan"), "no finite number for the amplitude in line 50"),
        (changed(50, 1, ""), "no finite number for the amplitude in line 50"),
        (changed(50, 2, "inf"), "no finite number for the phase in line 50"),
        (changed(50, 1, "ten"), "has 'ten' in line 50, which is not a number; remove this line, or the lines above it"),
        ("1,2,3\n" + measured_curve.text(), "has 'height_nm' in line 2, which is not a number; remove this line, or the lines"),
        (changed(50, 1, "-3"), "an amplitude below zero in line 50"),
        (measured_curve.text("\t").replace(".", "D"), "'40D0000' in line 2 is not a number; write numbers as 1234.5"),
        (constant_height(), "has the same height at every point; choose another column"),
        (b"\x1f\x8b\x08" + bytes(50), "is compressed; unpack it"),
        (b"\xd0\xcf\x11\xe0" + bytes(50), "is a workbook of Excel; save the sheet as CSV"),
        (changed(50, 0, "39"), "heights that go back and forth"),
        (shuffled(), "heights in no order: from point to point they scatter by .* sort the points"),
        (changed(50, 1, "1,5"), "has 4 cells in line 50 and 3 in the others"),
        (measured_curve.text()[:-12], "the file is incomplete|the file may be incomplete"),
        (measured_curve.text().rpartition(",")[0] + ",", "ends in the middle of line 121: the file is incomplete"),
        ("\n".join(measured_curve.text().splitlines()[:7]), "has 6 points, but a curve needs 8 or more"),
        (measured_curve.text(heading="height,amplitude_nm,phase_deg"), "has no unit for the height"),
        (measured_curve.text(heading="height_nm,amplitude_nm,phase"), "has no unit for the phase"),
        (measured_curve.text(heading="height_nm,amplitude_Hz,phase_deg"), "which is a frequency, not a length"),
        (measured_curve.text(heading="height_nm,force_nN,phase_deg"), "no column for the amplitude"),
        (measured_curve.text(heading="height_nm,amplitude_nm,amp_nm"), "several columns for the amplitude"),
        (measured_curve.text(",", ",", heading="height_nm,amplitude_nm,phase_deg"), "commas separate the numbers"),
        (measured_curve.text(heading="height_nm,amplitude_m,phase_deg"), r"largest amplitude of 20.1 m; 'm' is a wrong unit"),
        (measured_curve.text(heading="height_m,amplitude_nm,phase_deg"), "range of heights of 35 m; 'm' is a wrong unit"),
        (measured_curve.text("\t", ".").replace("20.0", "1,020.0"), "which is not a number|in the others"),
        (b"\x00\x01\x02\x03" * 100, "neither text nor a known kind of file"),
        (b"PK\x03\x04" + b"x" * 100, "is an archive; unpack it, or export a curve of JPK as text"),
        (b"\\*File list\r\n\\Version: 0x09", "Bruker's NanoScope; export the curve as text"),
    ])  # fmt: skip
def test_what_cannot_be_read_is_one_sentence(content, sentence, tmp_path):
    with pytest.raises(df.DForceError, match=sentence) as error:
        read(tmp_path, content)
    assert "\n" not in str(error.value)


def test_heights_that_grow_toward_the_sample_are_asked_for(tmp_path):
    content = "height_nm,amplitude_nm,phase_deg\n" + "".join(
        f"{-1e9 * h:.4f},{1e9 * a:.5f},{phi:.4f}\n" for h, a, phi in zip(HEIGHT, AMPLITUDE, LAG, strict=True)
    )
    with pytest.raises(df.ParameterError, match="write height_grows = 'toward'"):
        read(tmp_path, content)
    assert is_the_curve(read(tmp_path, content, height_grows="toward"))


def test_the_noise_of_a_sensor_is_no_step_back(tmp_path):
    draw = np.random.default_rng(3)
    noisy = HEIGHT + 0.2e-9 * draw.normal(size=len(HEIGHT))  # a step is 0.29 nm
    assert (np.diff(noisy) > 0.0).any()
    content = "height_nm,amplitude_nm,phase_deg\n" + "".join(
        f"{1e9 * h:.4f},{1e9 * a:.5f},{phi:.4f}\n" for h, a, phi in zip(noisy, AMPLITUDE, LAG, strict=True)
    )
    data = read(tmp_path, content)
    assert set(data.direction.values) == {"approach"}
    assert data.attrs["height_error"] == pytest.approx(0.2e-9, rel=0.3)  # by the median of 118 numbers
    assert any(
        line.startswith("height: repeats or turns back within the noise of the sensor")
        for line in data.attrs["history"]
    )
    assert "height_error" not in read(tmp_path, measured_curve.text()).attrs
    # a force is found all the same
    tune = {"f0": "70 kHz", "k": "2 N/m", "Q": 100}
    assert df.reconstruct(df.calibrate(data, phase_convention="lag", thermal=tune)).sizes["point"] == len(HEIGHT)


def test_a_phase_that_never_changes_was_not_measured(tmp_path):
    content = "height_nm,amplitude_nm,phase_deg\n" + "".join(
        f"{1e9 * h:.4f},{1e9 * a:.5f},90\n" for h, a in zip(HEIGHT, AMPLITUDE, strict=True)
    )
    with pytest.raises(df.ResultError, match="same phase at every point"):
        read(tmp_path, content)


def test_a_curve_of_frequency_modulation_comes_by_the_same_door(tmp_path):
    lines = ["z (nm),df (Hz),amplitude (nm),excitation (V)"]
    lines += [f"{1e9 * h:.4f},{-50 * np.exp(-1e9 * h / 5):.5f},5.0,0.25" for h in HEIGHT]
    data = read(tmp_path, "\n".join([*lines, ""]))
    assert {"height", "frequency_shift", "excitation"} <= set(data.variables)
    assert data.frequency_shift.attrs["units"] == "Hz" and data.excitation.attrs["units"] == "V"
    with pytest.raises(df.ParameterError, match="has no phase"):
        df.calibrate(data)


@pytest.mark.parametrize("row", ["{0:.1f},{1:.1f},{2},ok", "{0:.1f};{1:.1f};{2};ok"])
def test_a_column_of_words_is_named_where_there_is_no_table(tmp_path, row):
    """Beside decimal commas the first number was named."""
    path = tmp_path / "curve.csv"
    rows = "\n".join(row.format(10 - n, 5 - 0.1 * n, 90 + n) for n in range(20))
    if ";" in row:
        rows = rows.replace(".", ",")
    path.write_text(f"{'height_nm,amplitude_nm,phase_deg,status'.replace(',', row[6])}\n{rows}\n")
    with pytest.raises(
        df.ResultError, match="no table of numbers: 'ok' in line 2 is not a number; remove columns of words"
    ):
        df.read_measured(path)


def test_a_stop_at_the_turn_is_no_noise_of_the_heights(tmp_path):
    """Two points at the turning point made an error of 0.17 nm of all heights, which hid a wrong model."""
    rows = measured_curve.text(points=60).splitlines()
    assert "height_error" not in read(tmp_path, "\n".join([*rows, *rows[:0:-1], ""])).attrs
    assert "height_error" not in read(tmp_path, "\n".join([*rows, rows[-1], rows[-1], ""])).attrs
    # heights that repeat all along have the error of rounding to such steps, and no other
    twice = read(tmp_path, "\n".join([rows[0], *(row for row in rows[1:] for _ in range(2)), ""]))
    assert twice.attrs["height_error"] == pytest.approx(35e-9 / 59 / np.sqrt(12.0), rel=1e-3)


def test_each_cell_is_read_twice_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once to tell rows of numbers, and once for its value: a million rows take seconds."""
    read, value = [], text.Style.value
    monkeypatch.setattr(text.Style, "value", lambda style, cell: read.append(cell) or value(style, cell))
    rows = "".join(f"{0.1 * i:.3f},{20.0:.3f},{90.0:.3f}\n" for i in range(100))
    (table,) = text.read_text(b"height_nm,amplitude_nm,phase_deg\n" + rows.encode(), "a.csv")
    assert len(table.columns[0].values) == 100
    assert len(read) <= 2 * 300 + 10


def test_a_minus_sign_of_a_typesetter_is_a_minus(tmp_path):
    content = measured_curve.text(heading="height_nm,amplitude_nm,phase_deg")
    lines = [f"-{line}" if line[0].isdigit() else line for line in content.splitlines()]
    plain = read(tmp_path, "\n".join([*lines, ""]), height_grows="toward")
    typeset = read(tmp_path, "\n".join([*lines, ""]).replace("-", "\N{MINUS SIGN}"), height_grows="toward")
    np.testing.assert_array_equal(plain.height, typeset.height)


def test_columns_of_one_name_are_not_taken_by_chance(tmp_path):
    rows = [
        f"{1e9 * h:.4f},{1e9 * a:.5f},{2e9 * a:.5f},{p:.4f}" for h, a, p in zip(HEIGHT, AMPLITUDE, LAG, strict=True)
    ]
    content = "\n".join(["height_nm,{},{},phase_deg", *rows, ""])
    with pytest.raises(df.ParameterError, match=r"has 2 columns 'amp' for the amplitude; add the unit"):
        read(tmp_path, content.format("amp (nm)", "amp (nm)"), columns={"amplitude": "amp"})
    data = read(tmp_path, content.format("amp (mV)", "amp (nm)"), columns={"amplitude": "amp (nm)"})
    np.testing.assert_allclose(data.amplitude, 2.0 * AMPLITUDE, atol=1e-13)


def test_separators_of_thousands_that_pass_for_decimal_commas_are_doubted(tmp_path):
    rows = [f"{1e12 * h:,.0f}\t{1e12 * a:,.0f}\t{p:.0f}" for h, a, p in zip(HEIGHT, AMPLITUDE, LAG, strict=True)]
    data = read(tmp_path, "\n".join(["height_pm\tamplitude_pm\tphase_deg", *rows, ""]))
    assert any(line.startswith("doubt: the heights span only 35 pm") for line in data.attrs["history"])
    assert not any(line.startswith("doubt") for line in read(tmp_path, measured_curve.text()).attrs["history"])
