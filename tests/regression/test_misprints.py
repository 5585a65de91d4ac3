"""The page of the 2015 paper's misprints shows what it says."""

import pytest

from misprint_proofs import dimension, misprints, misprints_text

SHOWN = {misprint.equation: misprint.shown for misprint in misprints()}


@pytest.mark.parametrize(
    ("text", "unit"),
    [("Pa m^2", "kg m s^-2"), ("Pa s m^0.5 m m/s", "kg m^1.5 s^-2"), ("m/m", "1"), ("1/s^2", "s^-2"), ("kHz", "s^-1")],
)
def test_dimension_of_a_product_of_units(text, unit):
    assert dimension(text) == unit


@pytest.mark.parametrize(
    ("equation", "figures"),
    [
        ("(3)", ["0.935"]),  # 6.5 % between the masses of table 1
        ("(5)", ["s^-2", "81.53 kHz"]),
        ("(6), (7)", ["8 %", "27 %"]),
        ("(13)", ["1.2114", "0.7500", "1.0000"]),
        ("(14)", ["3.0000"]),
        ("(15)", ["0.3536", "in m as printed", "21.00"]),
        ("(17)", ["kg^2 s^-4"]),
        ("(19)", ["1.079, printed 1.543", "1.599, printed 13.848", "1.3333"]),
        ("(20)", ["kg m^1.5 s^-2"]),
        ("(21)", ["0.100"]),
    ],
)
def test_misprint_is_shown_by_the_figures_known(equation, figures):
    assert all(figure in SHOWN[equation] for figure in figures), SHOWN[equation]


def test_text_holds_each_with_both_equations():
    text = misprints_text()
    assert text.count("as printed:") == text.count("Use instead:") == len(SHOWN)
    assert text.count("$$") == 4 * len(SHOWN)
    assert all(shown in text for shown in SHOWN.values())
