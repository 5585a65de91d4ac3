"""Equations and docstrings, readable in a terminal."""

from __future__ import annotations

import subprocess
import sys

import pytest
from every import every

import dforce as df
from dforce.cli.app import COMMANDS
from dforce.cli.models import readable
from dforce.core.notation import first_sentence, plain_math


@pytest.mark.parametrize(
    ("latex", "text"),
    [
        (r"-\frac{H R}{6 d^2}", "-(H R)/(6 d²)"),
        (r"\tfrac{4}{3} E_\mathrm{eff} \sqrt{R}\, \delta^{3/2}", "4/3 E_eff √R δ^(3/2)"),
        (r"\sqrt{R \delta}", "√(R δ)"),
        (r"\delta = a_0 - d > 0", "δ = a₀ - d > 0"),
        (r"\dot d", "d\N{COMBINING DOT ABOVE}"),
        (r"\lambda, \Omega, \varepsilon_0", "λ, Ω, ε₀"),
        (r"x \quad y \qquad z", "x   y   z"),
        (r"a \le b \cdot c \to \infty", "a ≤ b · c → ∞"),
        (r"\left( x \right)^2", "(x)²"),
        (r"\tan\theta", " tan θ"),
        (r"e^{-d/\lambda}", "e^(-d/λ)"),
        (r"\unknown{x}", "unknownx"),
        (r"\frac{a}{", "a/()"),
    ],
)
def test_an_equation_is_text(latex, text):
    assert plain_math(latex) == text


def test_a_piecewise_equation_has_a_line_for_each_case():
    latex = r"F = \begin{cases} 0 & d > a_0 \\[1ex] -\gamma & d \le a_0 \end{cases}"
    assert plain_math(latex).split("\n") == ["F =", "   0   d > a₀", "   -γ   d ≤ a₀"]


def test_a_docstring_loses_its_marks():
    page = readable("""First :math:`a_0` line with `hertz` and :class:`dforce.Tip`.

    .. math:: F = -\\frac{H R}{6 d^2}

    - one
    - two
    """)
    assert page.split("\n\n") == [
        "First a₀ line with hertz and dforce.Tip.", "    F = -(H R)/(6 d²)", "- one", "- two",
    ]  # fmt: skip


@every(df.forces.REGISTRY.values())
def test_no_model_leaves_latex_on_the_page(model):
    page = readable(model.__doc__ or "")
    assert "\\" not in page and ":math:" not in page and "{" not in page
    assert "`" not in first_sentence(model.__doc__ or "")


def test_the_help_lists_all_commands_where_python_has_removed_their_texts():
    ran = [sys.executable, "-OO", "-m", "dforce", "--help"]
    page = subprocess.run(ran, capture_output=True, text=True, check=True).stdout
    assert page.endswith("".join(f"  {command.__name__}\n" for command in COMMANDS))
