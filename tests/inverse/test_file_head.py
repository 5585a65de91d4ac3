"""The head of a file: its columns, their first rows, and a guess of what each holds."""

from __future__ import annotations

from importlib.resources import files

import measured_curve
import numpy as np
import pytest

import dforce as df
from dforce.inverse.words import split_heading

SHIPPED = files("dforce.library") / "measured"


def head(tmp_path, heading, sign=1.0, more=""):
    """Return the head of the curve by formulas under other headings, its heights perhaps turned."""
    height, amplitude, lag = measured_curve.numbers()
    rows = [
        f"{sign * 1e9 * h:.4f},{1e9 * a:.5f},{phi:.4f}{more}" for h, a, phi in zip(height, amplitude, lag, strict=True)
    ]
    path = tmp_path / "curve.csv"
    path.write_text("\n".join([heading, *rows, ""]))
    return df.file_head(path)


SURE = {
    "Piezo Z,Ampl.,Ph": True,
    "Height (nm),Amp [nm],Phase (deg)": True,
    "Piezo Z / nm,Amplitude/nm,Phase / °": True,
    "Z sensor (nm),Amplitude (V),Phase (°)": True,
    "Stage,Lock-in R (V),theta (deg)": False,
    "Z scanner (um),Mag (mV),Phase angle x (rad)": False,
    "one (nm),Amp (nm),three (deg)": False,  # by what is left, and by the units
}


@pytest.mark.parametrize("heading", SURE)
def test_names_and_units_tell_height_amplitude_and_phase(tmp_path, heading):
    found = head(tmp_path, heading)
    assert [column.quantity for column in found.columns] == ["height", "amplitude", "phase"]
    assert all(column.sure for column in found.columns) is SURE[heading]
    assert (found.kind, found.curves, found.height_grows) == ("curve", 1, "away")


def test_a_head_counts_the_curves_that_a_reader_finds(tmp_path):
    rows = [f"{number},{z},{0.5 * z},{90 + z % 3}" for number in (1, 2, 3) for z in range(40, 0, -2)]
    path = tmp_path / "map.csv"
    path.write_text("\n".join(["curve,height (nm),amplitude (nm),phase (deg)", *rows, ""]))
    curves = df.read_curves(path, phase_convention="lag", direction="approach", amplitude_is="peak")
    assert df.file_head(path).curves == len(curves) == 3


@pytest.mark.parametrize(
    ("heading", "told"),
    [
        ("Piezo Z / nm", ("Piezo Z", "nm")), ("phase/°", ("phase", "deg")), ("height_nm", ("height", "nm")),
        ("z_\N{GREEK SMALL LETTER MU}m", ("z", "um")),
        ("sensitivity nm/V", ("sensitivity nm/V", None)), ("A/A0", ("A/A0", None)), ("trace/retrace", ("trace/retrace", None)),
    ],
)  # fmt: skip
def test_the_unit_of_a_heading_may_stand_behind_a_slash(heading, told):
    assert split_heading(heading) == told


def test_what_a_guess_is_sure_of_is_what_a_reader_takes(tmp_path):
    """A guess that is marked as sure must be that of the reader, or the table would show what is not done."""
    found = head(tmp_path, "Piezo Z (nm),Ampl. (nm),Ph (deg)")
    assert all(column.sure for column in found.columns)
    named, guessed = (
        df.read_measured(tmp_path / "curve.csv"),
        df.read_measured(tmp_path / "curve.csv", columns=found.roles()),
    )
    for name in ("height", "amplitude", "phase"):
        np.testing.assert_array_equal(named[name], guessed[name])


def test_the_sign_of_the_heights_is_read_from_the_curve(tmp_path):
    found = head(tmp_path, "Stage,Amp,Ph", sign=-1.0)
    assert found.height_grows == "toward"
    how = {"columns": found.roles(), "units": {"height": "nm", "amplitude": "nm", "phase": "deg"}}
    assert df.read_measured(tmp_path / "curve.csv", height_grows=found.height_grows, **how).sizes["point"] == 120


def test_a_column_has_one_role_and_a_role_one_column(tmp_path):
    found = head(tmp_path, "Height (nm),Amp (nm),Phase (deg),Amp (V),Ph (deg)", more=",1.5,90.0")
    assert list(found.roles()) == ["height", "amplitude", "phase"]
    assert found.roles()["amplitude"] == "Amp (nm)"
    assert [column.quantity for column in found.columns] == ["height", "amplitude", "phase", "", ""]


@pytest.mark.parametrize("both", [("amplitude", "phase"), ("height", "amplitude")])
def test_a_reader_refuses_one_column_for_two_quantities(tmp_path, both):
    head(tmp_path, "one,two,three")
    with pytest.raises(df.ParameterError, match="'two' cannot be both"):
        df.read_measured(tmp_path / "curve.csv", columns=dict.fromkeys(both, "two"))


def test_a_table_without_any_word_or_unit_shows_only_the_column_that_walks(tmp_path):
    found = head(tmp_path, "column 1,column 2,column 3")
    assert found.roles() == {"height": "column 1"}


def test_a_thermal_spectrum_is_told_from_a_curve():
    found = df.file_head(str(SHIPPED / "thermal.csv"))
    assert found.kind == "thermal spectrum" and found.height_grows is None
    tune = df.thermal_tune(str(SHIPPED / "thermal.csv"), columns=found.roles())
    assert pytest.approx(180.0, rel=0.1) == tune.Q


def test_the_head_shows_its_first_rows():
    found = df.file_head(str(SHIPPED / "stiff.csv"))
    assert found.rows(2) == [("34.15", "30.0507", "91.6585", "1"), ("33.95", "29.9681", "91.5702", "1")]
    text, page = str(found), found._repr_html_()
    assert all(word in text and word in page for word in ("amplitude (nm)", "34.15"))


def test_a_guess_that_a_person_must_confirm_has_a_question_mark(tmp_path):
    assert "height?" in str(head(tmp_path, "Stage,Amp (nm),Phase (deg)"))
