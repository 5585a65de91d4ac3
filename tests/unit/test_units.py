"""Text with a unit to SI numbers and back."""

import ast
import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from every import every
from hypothesis import given
from hypothesis import strategies as st

from dforce.core import units
from dforce.core.errors import UnitError

SOURCES = sorted(Path(units.__file__).parents[1].rglob("*.py"))
FINITE = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e100, max_value=1e100)


@every(
    [
        ("48.9 kHz", "Hz", 48900.0),
        ("0.165 nm", "m", 0.165e-9),
        ("0.9 N/m", "N/m", 0.9),
        ("2e-20 J", "J", 2e-20),
        ("90 deg", "rad", math.pi / 2),
        ("25 degC", "K", 298.15),
        ("0.89 mPa s", "Pa s", 0.89e-3),
        ("0.89 mPa·s", "Pa s", 0.89e-3),
        ("1 GPa", "Pa", 1e9),
        ("30 mJ/m^2", "J/m^2", 0.03),
        ("2 µm", "m", 2e-6),
        ("3 Å", "m", 3e-10),
        ("50 %", "1", 0.5),
        ("  5nm ", "m", 5e-9),
        ("1e-9", "m", 1e-9),
        ("\N{MINUS SIGN}5e\N{MINUS SIGN}1 nm", "m", -5e-10),
        (3, "m", 3.0),
        (np.float64(2.5), "m", 2.5),
        (np.int64(2), "m", 2.0),
        (np.array(2.5), "m", 2.5),
    ]
)
def test_what_a_user_writes_becomes_the_nearest_si_number(text, unit, value):
    # one rounding of the product at most; decimal prefixes are exact
    assert units.parse(text, unit) == pytest.approx(value, rel=1e-15)


def test_decimal_prefixes_give_the_very_float_that_a_programmer_types():
    assert units.parse("0.165 nm", "m") == 0.165e-9
    assert units.parse("48.9 kHz", "Hz") == 48.9e3
    assert units.parse("0.1 nm", "m") == 1e-10


@every(
    [
        ("48.9 nm", "Hz", "is '48.9 nm', which is a length, not a frequency"),
        ("5 rad/s", "Hz", "divide an angular frequency by 2 pi"),
        ("5 deg/s", "Hz", "divide an angular frequency by 2 pi"),
        ("5 rpm", "Hz", "divide an angular frequency by 2 pi"),
        ("5 1/s", "Hz", "divide an angular frequency by 2 pi"),
        ("5 furlongss", "m", "'furlongss' is not a known unit"),
        ("5 deg", "1", "is an angle, not a plain number"),
        ("3 %", "m", "is a plain number, not a length"),
        ("3 deg", "m", "is an angle, not a length"),
        ("0.5", "1", None),
        ("1", "rad", None),
        ("5 m", "rad", "which is a length, not an angle"),
        ("0,5 nm", "m", "is '0,5 nm', a decimal comma; write a point: '0.5 nm'"),
        ("1.234,5 nm", "m", "is '1.234,5 nm'; write the number without separators of thousands"),
        ("1,234.5 nm", "m", "write the number without separators"),
        ("nm", "m", "is 'nm', which is not a number with a unit"),
        ("", "m", "which is not a number with a unit"),
        ("nan", "m", "is 'nan', which is not a number"),
        ("inf nm", "m", "which is not a number"),
        ("1e999 nm", "m", "is 1e999 nm, which is not a finite number"),
        ("1e400", "m", "not a finite number"),
        (float("nan"), "m", "is nan, which is not a finite number"),
        (float("-inf"), "m", "is -inf, which is not a finite number"),
        (10**400, "m", "not a finite number"),
        (True, "m", "is true, which is neither a number nor text"),
        (None, "m", "is None, which is neither a number nor text"),
        ([1.0], "m", "neither a number nor text"),
        (1j, "m", "neither a number nor text"),
        ("1" * 100_000, "m", "which is not a number with a unit"),
        ("5 " + "m" * 100_000, "m", "which is not a number with a unit"),
        ("5 m**99", "m", "is not a unit"),
        ("5 __import__('os')", "m", "is not a unit"),
        ("5 (((((", "m", "is not a unit"),
        ("12 nm**9**9**9**9", "m", "'nm**9**9**9**9' is not a unit (for example in nm)"),
        ("5 m\n", "m", None),
    ]
)
def test_anything_else_is_one_short_sentence(text, unit, words):
    if words is None:
        assert math.isfinite(units.parse(text, unit))
        return
    with pytest.raises(UnitError) as raised:
        units.parse(text, unit)
    message = str(raised.value)
    assert words in message
    assert "\n" not in message
    assert len(message) < 250


@given(FINITE, st.sampled_from(sorted([*units.SHOWN, "1", "kg/m^3", "1/m"])))
def test_showing_a_value_loses_nothing(value, unit):
    assert units.parse(units.show(value, unit), unit) == value


@given(st.text(max_size=60), st.sampled_from(["m", "Hz", "1"]))
def test_no_text_makes_anything_but_a_number_or_a_unit_error(text, unit):
    try:
        assert math.isfinite(units.parse(text, unit))
    except UnitError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (48900.0, "Hz", "48.9 kHz"),
        (0.165e-9, "m", "0.165 nm"),
        (0.9, "N/m", "0.9 N/m"),
        (2e-20, "J", "20 zJ"),
        (1e9, "Pa", "1 GPa"),
        (math.pi / 2, "rad", "90 deg"),
        (298.15, "K", "298.15 K"),
        (-2e-9, "m", "-2 nm"),
        (0.0, "m", "0 m"),
        (255.0, "1", "255"),
        (0.0008900, "Pa s", "0.89 mPa s"),
    ],
)
def test_units_are_chosen_for_the_reader(value, unit, text):
    assert units.show(value, unit) == text


def test_minus_zero_is_shown_as_zero_and_spoils_no_zero_after_it():
    assert [units.show(value, "m", digits) for digits in (None, 3) for value in (-0.0, 0.0)] == 4 * ["0 m"]


def test_a_scale_is_the_decimal_number_that_it_is_by_definition():
    """Some versions of pint come to 1.0000000000000002e-09 for the nN, on their way through kg m/s^2."""
    for unit, names in units.SHOWN.items():
        for name in names:
            scale = units.unit_scale(name)[0]
            assert units.parse(f"2 {name}", unit) == 2.0 * scale
            for rounded in (math.nextafter(scale, 0.0), scale, math.nextafter(scale, 1e99)):
                assert units._decimal(rounded) == (rounded if name == "deg" else scale)
    assert units.parse("2 nN", "N") == 2e-9


def test_a_value_is_shown_with_as_many_digits_as_asked_for():
    assert units.show(4.0553735e-9, "m", 5) == "4.0554 nm"
    assert units.show(-123.4e-9, "m", 2) == "-120 nm"  # without an exponent
    assert units.show(math.inf, "m", 3).startswith("inf")


@pytest.mark.slow
def test_units_are_known_whatever_became_of_the_copy_of_pint_that_read_them_first(tmp_path):
    import pint

    def tell(libraries):
        code = "from dforce.core import units; print(units.parse('1 bar', 'Pa'))"
        places = [str(libraries), str(Path(units.__file__).parents[2])]
        env = os.environ | {
            "PYTHONPATH": os.pathsep.join(places),
            "XDG_CACHE_HOME": str(tmp_path),
            "LOCALAPPDATA": str(tmp_path),
        }
        return subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=False).stdout

    first, second = tmp_path / "first", tmp_path / "second"
    for libraries in (first, second):
        shutil.copytree(
            Path(pint.__file__).parent, libraries / "pint"
        )  # with the times of the files, as installers copy them
    assert tell(first) == "100000.0\n"
    shutil.rmtree(first)
    assert tell(second) == "100000.0\n"
    for kept in tmp_path.rglob("*.pickle"):
        kept.write_bytes(b"")
    assert tell(second) == "100000.0\n"


@every(sorted(units.QUICK))
def test_the_units_that_need_no_pint_are_what_pint_says(unit):
    kind, scale = units.QUICK[unit]
    one = units.registry().Quantity(1.0, units._pint_unit(unit)).to_base_units()
    known = units.registry().Quantity(1.0, units._pint_unit(kind)).to_base_units()
    assert one.units == known.units
    assert known.magnitude == 1.0
    assert units._decimal(float(one.magnitude)) == scale


def test_a_case_in_usual_units_never_loads_pint():
    code = "import sys, dforce as df; df.example('figure-3-air').problem; print('pint' in sys.modules)"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "False"


def test_a_list_of_quantities_is_read_as_each_alone_is():
    assert units.parse_all(["1 nm", 2e-9, np.float64(3e-9)], "m") == [1e-9, 2e-9, 3e-9]
    assert units.parse_all("1 nm", "m") == units.parse_all(1e-9, "m") == units.parse_all(np.array(1e-9), "m") == [1e-9]
    for wrong in (None, object(), ["1 nm", None], int):
        with pytest.raises(UnitError):
            units.parse_all(wrong, "m")


@every(sorted(units.STORED))
def test_a_unit_that_is_stored_in_another_is_read_as_that(unit):
    assert units.stored(unit) != unit
    assert math.isfinite(units.parse(f"1 {unit}", units.stored(unit)))


def test_both_ends_of_a_range_have_the_unit_of_the_larger_one():
    assert units.show_range(-6.9e-10, -8.1e-12, "m", 3) == "-0.69 nm to -0.0081 nm"
    assert units.show_range(-0.0, 7.4e-11, "m", 3) == "0 pm to 74 pm"
    assert units.show_range(0.5, 2.0, "1", 3) == "0.5 to 2"
    assert units.show_range(9e-10, 1.2e-9, "N", 3, "and") == "0.9 nN and 1.2 nN"
    assert units.show_range(1.2345e6, 2e6, "N/m", 3) == "1230000 N/m to 2000000 N/m"


def test_ends_that_differ_by_more_than_a_thousand_have_units_of_their_own():
    assert units.show_range(10.0, 2e12, "Pa", 3) == "10 Pa to 2000 GPa"
    assert units.show_range(1e6, 1e9, "Pa", 3) == "0.001 GPa to 1 GPa"


def test_no_sentence_writes_the_ends_of_a_range_each_in_a_unit_of_its_own():
    """As in "900 pN to 1.2 nN"; `show_range` writes both ends in one unit."""
    for path in SOURCES:
        for text in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(text, ast.JoinedStr):
                line = "".join(_piece(piece) for piece in text.values)
                assert not re.search(r"# to #|etween # and #", line), f"{path.name}: {ast.unparse(text)}"


def _piece(piece: ast.expr) -> str:
    """Return text as it is, a number with the unit chosen for it as #, any other value as ?."""
    if isinstance(piece, ast.Constant):
        return str(piece.value)
    value = piece.value if isinstance(piece, ast.FormattedValue) else piece
    name = ast.unparse(value.func).rpartition(".")[2] if isinstance(value, ast.Call) else ""
    return "#" if name in ("show", "shown", "number") else "?"
