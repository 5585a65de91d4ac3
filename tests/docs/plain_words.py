"""How users' text must read: its sentences, taken out of pages and source files, and the patterns that none of them has."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

LONGEST = 30  # words in a sentence
_PERSON = r"(?:you|we|they|who|users?|authors?|people|nobody|somebody|readers?|newcomers?|makers?|students?)"
_QUESTION = r"(?![^.]*\?)"  # a question may begin with "what"


def _person_may(verbs: str) -> str:
    """Return the pattern of verbs that a person may be the subject of, and nothing else."""
    return rf"(?P<who>\b{_PERSON} (?:may |do not |cannot |does not )?)?\b(?P<verb>{verbs})\b"


# Patterns that no sentence has, with the words to write in its place.
PATTERNS = {
    name: (re.compile(pattern, re.IGNORECASE), remedy)
    for name, pattern, remedy in (
        ("what ... of", rf"\bwhat\b(?: [^\s,.;:?]+){{0,6}} of\b{_QUESTION}", "name the thing"),
        (
            "what it is",
            rf"\bwhat (?:it|they|this|that) "
            rf"(?:is|are|was|were|do|does|did|has|have)\b{_QUESTION}",
            "name the thing",
        ),
        (
            "what as a noun",
            r"\b(?:of|from|for|to|in|with|by|than|and|is|are|at|on|besides?|like|into|as|but|not|just|only|exactly) what\b"
            + _QUESTION,
            "name the thing",
        ),
        ("what as a subject", r"^what (?!if\b)[^?]*[^?]$", "name the thing"),
        ("that of", r"\b(?:that|those) of\b", "repeat the noun"),
        ("those that", r"\b(?:those|the ones?|one|ones) (?:that|which)\b", "repeat the noun"),
        ("such as are", r"\bsuch as (?:are|is|has|have)\b", "name the thing"),
        ("tells", _person_may("tells?|told|telling"), "shows, contains, constrains, distinguishes"),
        ("says", _person_may("says?|said|saying"), "shows, contains, is"),
        ("knows", _person_may("knows?|knew|knowing"), "has, takes, contains"),
        ("stands", r"\b(?:stands?|stood)\b|\bstanding (?!waves?\b)", "is, lies, tolerates"),
        ("is given", r"\b(?:is|are|was|were|be|been|being) given\b", "has, contains, is missing"),
        ("otherwise than", r"\botherwise than\b", "differently from"),
        ("whoever", r"\b(?:whoever|whatever|whichever)\b", "name the person or the thing"),
        ("the very", r"\bthe very\b", "leave it out"),
        ("give it", r"\b(?:gives?|returns?) (?:it|them)\b\.?$", "name the thing"),
    )
}


class Sentence(NamedTuple):
    """A sentence of users' text, and its place."""

    place: str
    line: int
    text: str


def faults(sentence: str) -> list[str]:
    """Return the patterns that a sentence has; a sentence above the longest is one, too."""
    found = [
        name
        for name, (pattern, _) in PATTERNS.items()
        if any(not m.groupdict().get("who") for m in pattern.finditer(sentence))
    ]
    words = len([w for w in sentence.split() if re.search(r"\w", w)])
    if words > LONGEST:
        found.append(f"{words} words")
    return found


# ---------------------------------------------------------------------------------------------------- text to sentences
_END = re.compile(r"(?<=[.!?])[)\"'”*_]*\s+(?=[\"'“(*_`]*[A-Z0-9`{§]|dForce|[a-z]+`|[a-z_]+:)")
_SHORT = re.compile(
    r"\b(?:e\.g|i\.e|cf|vs|Fig|Eq|Eqs|Sec|Ref|Refs|No|al|approx|resp|Phys|Rev|Appl|Lett|Nanotechnol|Beilstein J|J|[A-Z])\.$"
)


def plain(text: str) -> str:
    """Return text without its markup: code, mathematics and links count as one word."""
    text = re.sub(r"\{[a-z:]+\}`([^`<]*?)\s*(?:<[^`]*>)?`", r"\1", text)
    text = re.sub(r":math:`[^`]*`", "EQUATION", text)
    text = re.sub(r":[a-z:]+:`~?([^`<]*?)\s*(?:<[^`]*>)?`", r"\1", text)
    text = re.sub(r"``[^`]*``|`[^`]*`(?!_)", "CODE", text)
    text = re.sub(r"`([^`<]*?)\s*<[^`]*>`__?", r"\1", text)
    text = re.sub(r"\$[^$\n]+\$", "EQUATION", text)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"\*\*?([^*]+)\*\*?", r"\1", text)
    text = re.sub(r"\((?:[^()]|\([^()]*\))*\b(?:18|19|20)\d\d\b(?:[^()]|\([^()]*\))*\)", "", text)  # a citation
    return re.sub(r"\s+", " ", text).strip()


def sentences(paragraph: str) -> Iterator[str]:
    """Give the sentences of a paragraph."""
    whole = ""
    for part in _END.split(plain(paragraph)):
        whole = f"{whole} {part}" if whole else part
        if not _SHORT.search(whole):
            yield whole
            whole = ""
    if whole:
        yield whole


def blocks(text: str) -> Iterator[tuple[int, str]]:
    """Give paragraphs, list items, table cells and captions of Markdown or reStructuredText, with their first line."""
    fence, paragraph, start = "", [], 0
    indented_code = -1
    for number, line in enumerate([*text.splitlines(), ""], 1):
        stripped = line.strip()
        opened = re.match(r"(`{3,}|~{3,})(.*)", stripped)
        if fence:
            caption = re.match(r":(?:caption|alt):\s*(.*)", stripped)
            if caption:
                yield number, caption[1]
            if opened and stripped == fence:
                fence = ""
            continue
        indent = len(line) - len(line.lstrip())
        if indented_code >= 0:
            if not stripped or indent > indented_code:
                continue
            indented_code = -1
        ends = (
            not stripped or opened or re.match(r"([-*+]|\d+\.)\s|[|:#]|\.\. |={3,}|-{3,}|\^{3,}|~{3,}|</?\w", stripped)
        )
        if ends and paragraph:
            yield start, " ".join(paragraph)
            paragraph = []
        if opened:
            if not re.match(r"\{(figure|note|tip|warning|important|grid.*|dropdown|seealso)\}", opened[2]):
                fence = opened[1]
            continue
        directive = re.match(r"\.\. ([\w-]+)::", stripped)
        if directive:
            if directive[1] not in ("note", "tip", "warning", "important"):
                indented_code = indent
            continue
        if not stripped or re.match(r":::|={3,}|-{3,}|\^{3,}|~{3,}|<|\|[-: |]+\|$", stripped):
            continue
        option = re.match(r":([\w-]+):\s*(.*)", stripped)
        if option and not stripped.startswith(":math:"):
            if option[1] in ("caption", "alt"):
                yield number, option[2]
            continue
        if stripped.startswith("|"):
            for cell in re.split(r"(?<!\\)\|", stripped.strip("|")):
                yield number, cell
            continue
        if stripped.startswith("#"):
            yield number, stripped.lstrip("# ")
            continue
        if not paragraph:
            start = number
        paragraph.append(re.sub(r"^([-*+]|\d+\.)\s+", "", stripped))
        if stripped.endswith("::"):
            yield start, " ".join(paragraph)
            paragraph, indented_code = [], indent


def of_page(path: Path, root: Path) -> Iterator[Sentence]:
    """Give the sentences of a page in Markdown or reStructuredText."""
    place = path.relative_to(root).as_posix()
    for line, block in blocks(path.read_text(encoding="utf-8")):
        for sentence in sentences(block):
            yield Sentence(place, line, sentence)


# -------------------------------------------------------------------------------------------------- source to sentences
def _joined(node: ast.expr) -> str | None:
    """Return the text of a literal, a value in it as one word; None for anything else."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(str(v.value) if isinstance(v, ast.Constant) else "VALUE" for v in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        left, right = _joined(node.left), _joined(node.right)
        return None if left is None and right is None else (left or "VALUE") + (right or "VALUE")
    return None


def _of_source(path: Path, docstrings: bool) -> Iterator[tuple[int, str]]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    documented = {}

    def document(node: ast.Module | ast.ClassDef | ast.FunctionDef, public: bool) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                document(child, public and not child.name.startswith("_") and not isinstance(node, ast.FunctionDef))
            elif not isinstance(child, ast.expr):
                document(child, public)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and node.body:
            first = node.body[0]
            if (
                isinstance(first, ast.Expr)
                and isinstance(first.value, ast.Constant)
                and isinstance(first.value.value, str)
            ):
                documented[first.value] = public

    document(tree, True)
    inside: set[ast.AST] = {
        node.value for node in ast.walk(tree) if isinstance(node, ast.Expr) and node.value not in documented
    }
    for node in ast.walk(tree):
        if node in documented:
            if docstrings and documented[node]:
                yield node.lineno, ast.get_docstring(ast.Module([ast.Expr(node)], [])) or ""
            continue
        if node in inside or not isinstance(node, ast.expr):
            continue
        text = _joined(node)
        if text is not None:
            inside.update(ast.walk(node))
            if len(text.split()) >= 4 and re.search(r"[a-z]{2} [a-z]{2}", text):
                yield node.lineno, text


def of_source(path: Path, root: Path, *, docstrings: bool = True) -> Iterator[Sentence]:
    """Give the sentences in the public docstrings and in the texts of a source file."""
    place = path.relative_to(root).as_posix()
    for line, text in _of_source(path, docstrings):
        for offset, block in blocks(text):
            for sentence in sentences(block):
                yield Sentence(place, line + offset - 1, sentence)
