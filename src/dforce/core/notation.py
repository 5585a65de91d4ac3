"""Symbols and equations in LaTeX, and docstrings, as plain text for terminals or as HTML for pages."""

from __future__ import annotations

import html
import inspect
import re
import unicodedata
from collections.abc import Callable

from dforce.core.errors import checked

GAP = "\0"  # replaces a wide space until the other spaces are counted
SIGNS = {
    "le": "≤", "leq": "≤", "ge": "≥", "geq": "≥", "ne": "≠", "approx": "≈", "sim": "~", "simeq": "≈",
    "gg": "≫", "ll": "≪", "cdot": "·", "times": "×", "pm": "±", "to": "→", "infty": "∞", "int": "∫",
    "sum": "Σ", "partial": "∂", "langle": "⟨", "rangle": "⟩", "lvert": "|", "rvert": "|",
    "ldots": "...", "dots": "...",
    ",": " ", ";": " ", ":": " ", "!": "", " ": " ", "left": "", "right": "", "displaystyle": "",
    "{": "{", "}": "}", "quad": GAP, "qquad": GAP,
}  # fmt: skip
ACCENTS = {
    "dot": "\N{COMBINING DOT ABOVE}",
    "ddot": "\N{COMBINING DIAERESIS}",
    "bar": "\N{COMBINING MACRON}",
    "tilde": "\N{COMBINING TILDE}",
    "hat": "\N{COMBINING CIRCUMFLEX ACCENT}",
}
FUNCTIONS = ("sin", "cos", "tan", "sinh", "cosh", "tanh", "coth", "arctan", "arccos", "exp", "ln", "log", "max", "min")
UPRIGHT = ("mathrm", "text", "operatorname", "mathit")
RAISED = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
LOWERED = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
LONGEST, DEEPEST = 4000, 20  # characters of an equation, and groups in groups; beyond that it is shown as it was typed
TOKEN = re.compile(r"\\[a-zA-Z]+\*?|\\.|[{}^_&]|\s+|[^\\{}^_&\s]", re.DOTALL)
CASES = re.compile(r"\\begin\{cases\}(.*?)\\end\{cases\}", re.DOTALL)


@checked
def plain_math(latex: str) -> str:
    """Return an equation in LaTeX as text; each case of a piecewise equation has its own line."""
    if len(latex) > LONGEST:
        return latex
    latex = CASES.sub(lambda match: "\n" + _cases(match[1]), latex)
    lines = [_Reader(line).everything() for line in latex.split("\n")]
    return "\n".join(_spaced(line) for line in lines if line.strip())


@checked
def html_symbol(latex: str) -> str:
    """Return a symbol in LaTeX as HTML with subscripts and superscripts; other markup is escaped."""
    escaped = html.escape(latex, quote=True)
    return escaped if len(escaped) > LONGEST else _Reader(escaped, _html_script).everything().strip()


def _html_script(text: str, sign: str) -> str:
    tag = "sup" if sign == "^" else "sub"
    return f"<{tag}>{text}</{tag}>"


def _spaced(line: str) -> str:
    """Return a line with single spaces, and wide ones where the equation has them."""
    line = re.sub(r"\( +| +\)", lambda match: match[0].strip(), " ".join(line.split(" ")))
    return re.sub(f" *{GAP}[ {GAP}]*", "   ", re.sub(" +", " ", line)).rstrip()


def _cases(latex: str) -> str:
    """Return a line for each case, its condition behind it."""
    rows = [row.split("&") for row in re.split(r"\\\\(?:\[[^]]*\])?", " ".join(latex.split()))]
    return "\n".join(r"\quad " + r" \qquad ".join(part.strip() for part in row) for row in rows if row[0].strip())


class _Reader:
    """Reads LaTeX from left to right; an unknown command stays, without the backslash."""

    def __init__(self, latex: str, script: Callable[[str, str], str] | None = None) -> None:
        self.tokens = TOKEN.findall(latex)
        self.script = script or _script
        self.place = self.depth = 0

    def everything(self) -> str:
        """Return all of it."""
        parts = []
        while self.place < len(self.tokens):
            parts.append(self.one())
        return "".join(parts)

    def argument(self) -> str:
        """Return the argument of a command: a group in braces, or the next token."""
        while self.place < len(self.tokens) and self.tokens[self.place].isspace():
            self.place += 1
        if self.place >= len(self.tokens):
            return ""
        return self.one()

    def group(self) -> str:
        """Return the text up to the closing brace."""
        parts = []
        while self.place < len(self.tokens) and self.tokens[self.place] != "}":
            parts.append(self.one())
        self.place += 1
        return "".join(parts).strip()

    def one(self) -> str:
        """Return the next token or group as text."""
        token: str = self.tokens[self.place]
        self.place += 1
        if token.isspace():
            return " "
        if self.depth == DEEPEST or not token.startswith(("{", "^", "_", "\\")):
            return token
        self.depth += 1
        if token == "{":
            text = self.group()
        else:
            text = self.script(self.argument(), token) if token in "^_" else self.command(token[1:].rstrip("*"))
        self.depth -= 1
        return text

    def command(self, name: str) -> str:
        """Return the text for a command."""
        if name in ("frac", "tfrac", "dfrac"):
            above, below = self.argument(), self.argument()
            return f"{_closed(above)}/{_closed(below)}"
        if name == "sqrt":
            return f"√{_closed(self.argument())}"
        if name in ACCENTS:
            return self.argument() + ACCENTS[name]
        if name in UPRIGHT:
            return self.argument()
        if name in FUNCTIONS:
            return f" {name} "
        if name in SIGNS:
            return SIGNS[name]
        name = name.removeprefix("var")
        kind = "CAPITAL" if name[:1].isupper() else "SMALL"
        spelled = "LAMDA" if name.lower() == "lambda" else name.upper()  # the spelling of Unicode
        try:
            return unicodedata.lookup(f"GREEK {kind} LETTER {spelled}")
        except KeyError:
            return name


def _script(text: str, sign: str) -> str:
    if sign == "^":
        return text.translate(RAISED) if re.fullmatch(r"-?\d", text) else f"^{_closed(text)}"
    return text.translate(LOWERED) if text.isdigit() else f"_{text}"


def _closed(text: str) -> str:
    """Return a term in parentheses where it has more than one part."""
    alone = re.fullmatch(r"[\w.*⁰¹²³⁴⁵⁶⁷⁸⁹₀₁₂₃₄₅₆₇₈₉\u0300-\u036f]+|\([^()]*\)", text)
    return text if alone else f"({text})"


@checked
def unmarked(text: str) -> str:
    """Return a paragraph without marks: equations as text, code and names as they are typed."""
    text = re.sub(r":math:`([^`]*)`", lambda match: plain_math(match[1]).strip(), text)
    text = re.sub(r":\w+(?::\w+)?:`~?([^`]*)`", r"\1", text)
    return re.sub(r"``?([^`]*)``?", r"\1", text)


@checked
def first_sentence(docstring: str) -> str:
    """Return the first line of a docstring, without its marks."""
    return unmarked(inspect.cleandoc(docstring).split("\n")[0])


def first_phrase(words: str) -> str:
    """Return an explanation up to its first sign: "Hamaker constant" of "Hamaker constant; default: ..."."""
    return re.split(r"[;:,] | [({]", words, maxsplit=1)[0]
