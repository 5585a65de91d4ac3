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


def faults(sentence: str, longest: int = LONGEST) -> list[str]:
    """Return the patterns that a sentence has; a sentence above the longest is one, too."""
    found = [
        name
        for name, (pattern, _) in PATTERNS.items()
        if any(not m.groupdict().get("who") for m in pattern.finditer(sentence))
    ]
    words = len([w for w in sentence.split() if re.search(r"\w", w)])
    if words > longest:
        found.append(f"{words} words")
    return found


# ---------------------------------------------------------------------------------------------------- text to sentences
_END = re.compile(r"(?<=[.!?])[)\"'”*_]*\s+(?=[\"'“(*_`]*[A-Z0-9`{§]|d[Ff]orce|[a-z]+`|[a-z_]+:)")
_SHORT = re.compile(
    r"\b(?:e\.g|i\.e|cf|vs|Fig|Eq|Eqs|Sec|Ref|Refs|No|al|approx|resp|Phys|Rev|Appl|Lett|Nanotechnol|Beilstein J|J|[A-PR-Z])\.$"
)


_CITATION = re.compile(r"\((?:[^()]|\([^()]*\))*?\(?\b(?:18|19|20)\d\d\b\)?(?:[^()]|\([^()]*\))*\)")


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
    text = _CITATION.sub("", text)
    text = re.sub(r"CODE(?:(?:, | and | or |, and |, or )CODE)+", "CODE", text)  # a list of names counts as one word
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


_SHOWN = re.compile(r"\{(figure|note|tip|warning|important|grid.*|dropdown|seealso)\}")  # fences whose body is text
_ITEM = re.compile(r"([-*+]|\d+\.)\s+")
_RULE = re.compile(r":::|={3,}|-{3,}|\^{3,}|~{3,}|<|\|[-: |]+\|$")
_OPTION = re.compile(r":([\w-]+):\s+(.*)")


def blocks(text: str) -> Iterator[tuple[int, str]]:
    """Give paragraphs, list items, table cells and captions of Markdown or reStructuredText, with their first line."""
    fence, paragraph, start = "", [], 0
    further = -1  # indent of the further lines of a paragraph; -1 behind the first line of a list item
    code = -1  # indent of the line before a block of code
    for number, line in enumerate([*text.splitlines(), ""], 1):
        stripped, indent = line.strip(), len(line) - len(line.lstrip())
        opened, option = re.match(r"(`{3,}|~{3,})(.*)", stripped), _OPTION.match(stripped)
        if option is not None and option[1] in ("caption", "alt"):
            yield number, option[2]
        if fence:
            fence = "" if stripped == fence else fence
            continue
        if code >= 0 and (not stripped or indent > code):
            continue
        code = -1
        directive = re.match(r"\.\. [\w-]+::", stripped)
        starts = _ITEM.match(stripped)
        aside = not stripped or opened or option or directive or _RULE.match(stripped) or stripped[0] in "|#"
        if paragraph and (aside or starts or (further >= 0 and indent != further)):
            yield start, " ".join(paragraph)
            paragraph = []
        further = indent if further < 0 else further
        if opened and not _SHOWN.match(opened[2]):
            fence = opened[1]
        elif directive:
            code = indent
        elif stripped.startswith("|") and not _RULE.match(stripped):
            yield from ((number, cell) for cell in re.split(r"(?<!\\)\|", stripped.strip("|")))
        elif stripped.startswith("#"):
            yield number, stripped.lstrip("# ")
        if aside:
            continue
        if not paragraph:
            start, further = number, -1 if starts else indent
        paragraph.append(_ITEM.sub("", stripped, count=1) if starts else stripped)
        if stripped.endswith("::"):
            yield start, " ".join(paragraph)
            paragraph, code = [], indent


def of_page(path: Path, root: Path) -> Iterator[Sentence]:
    """Give the sentences of a page in Markdown or reStructuredText."""
    place = path.relative_to(root).as_posix()
    for line, block in blocks(path.read_text(encoding="utf-8")):
        for sentence in sentences(block):
            yield Sentence(place, line, sentence)


# -------------------------------------------------------------------------------------------------- source to sentences
_CODE = re.compile(
    r"\s*(?:def |from \S+ import |import |class |@)|.*\n    return ", re.DOTALL
)  # texts that are programs


def _joined(node: ast.expr) -> str | None:
    """Return the text of a literal, a value in it as one word; None for anything else."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "VALUE" for part in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        left, right = _joined(node.left), _joined(node.right)
        return None if left is None and right is None else (left or "VALUE") + (right or "VALUE")
    return None


def of_source(path: Path, root: Path) -> Iterator[Sentence]:
    """Give the sentences in the texts of a source file, without its docstrings: all with four words or more."""
    place = path.relative_to(root).as_posix()
    inside: set[ast.AST] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Expr):
            inside.add(node.value)  # a docstring, of an attribute too
        if node in inside or not isinstance(node, ast.expr):
            continue
        text = _joined(node)
        if text is None:
            continue
        inside.update(ast.walk(node))
        if len(text.split()) >= 4 and re.search(r"[a-z]{2} [a-z]{2}", text) and not _CODE.match(text):
            for offset, block in blocks(text):
                yield from (Sentence(place, node.lineno + offset - 1, sentence) for sentence in sentences(block))


def of_script(path: Path, root: Path) -> Iterator[Sentence]:
    """Give the sentences of a script of the gallery: its docstring, its blocks of comments behind ``# %%``, its texts."""
    source, place = path.read_text(encoding="utf-8"), path.relative_to(root).as_posix()
    shown = [(1, ast.get_docstring(ast.parse(source)) or "")]
    for block in re.finditer(r"^# %%.*\n((?:#.*\n)+)", source, re.MULTILINE):
        line = source.count("\n", 0, block.start(1)) + 1
        shown.append((line, re.sub(r"^# ?", "", block[1], flags=re.MULTILINE)))
    for line, text in shown:
        for offset, paragraph in blocks(text):
            yield from (Sentence(place, line + offset - 1, sentence) for sentence in sentences(paragraph))
    yield from of_source(path, root)
