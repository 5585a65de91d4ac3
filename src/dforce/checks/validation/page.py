"""The page of a validation, in Markdown: every figure on it comes from the result."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from dforce.core.errors import ParameterError, checked

Row = Mapping[str, Any]
PIVOTED = ("identities", "curves")  # parts whose groups are columns


@checked
def validation_page(result: Mapping[str, Any]) -> str:
    """Return the page of a result of :func:`dforce.checks.validation.validate`, in Markdown.

    Raises
    ------
    ParameterError
        When it is another table.
    """
    if not {"parts", "machine", "quick", "seconds"} <= {*result}:
        raise ParameterError("result is not from dforce.checks.validation.validate")
    blocks = ["# Validation", _introduction(result), _summary(result), *_missed(result)]
    for part in result["parts"]:
        blocks += [f"## {part['title']}", part["text"]]
        blocks += _pivot(part) if part["name"] in PIVOTED else _groups(part)
        blocks += _cases(part)
    return "\n\n".join(block for block in blocks if block) + "\n"


def _introduction(result: Mapping[str, Any]) -> str:
    machine = ", ".join(f"{key} {value}" for key, value in result["machine"].items())
    which = "the quick part: `dforce validate --quick`" if result["quick"] else "all checks: `dforce validate`"
    return (
        f"Results of dForce, compared with published equations, exact balances and independent integrators. This page is "
        f"{which}. It took {result['seconds']:.0f} s and prints every figure here. ({machine})"
    )


def _summary(result: Mapping[str, Any]) -> str:
    rows = []
    for part in result["parts"]:
        limited = [check for check in part["checks"] if check["limit"] is not None]
        met = sum(check["met"] for check in limited)
        rows.append((part["title"], str(len(limited)), str(met), str(len(limited) - met)))
    return table(("part", "checks", "met", "not met"), rows)


def _missed(result: Mapping[str, Any]) -> list[str]:
    missed = [check for part in result["parts"] for check in part["checks"] if not check["met"]]
    if not missed:
        return ["Every check is met."]
    rows = [
        (
            check["group"],
            check["name"],
            number(check["found"]),
            number(check["expected"]),
            small(check["error"]),
            small(check["limit"]),
            f"{check['source']} {check['note']}".strip(),
        )
        for check in missed
    ]
    return ["## Not met", table(("group", "check", "found", "expected", "error", "limit", "why"), rows)]


def _groups(part: Mapping[str, Any]) -> Iterable[str]:
    for title in dict.fromkeys(check["group"] for check in part["checks"]):
        checks = [check for check in part["checks"] if check["group"] == title]
        yield f"### {title[:1].upper()}{title[1:]}"
        if part["name"] == "random":
            yield _disagreements(checks)
        elif part["name"] == "orders":
            rows = [
                (
                    c["name"],
                    f"{c['found']:.2f}",
                    f"{c['expected'] - c['limit']:.2f} to {c['expected'] + c['limit']:.2f}",
                    c["source"],
                    c["note"],
                    verdict(c),
                )
                for c in checks
            ]
            yield table(("", "order", "expected", "from", "note", ""), rows)
        else:
            yield from _values(checks)


def _values(checks: Sequence[Row]) -> Iterable[str]:
    sources = list(dict.fromkeys(check["source"] for check in checks if check["source"]))
    if sources:
        yield ". ".join(sources) + "."
    rows = [
        (
            c["name"],
            number(c["found"]),
            number(c["expected"]),
            unit(c["unit"]),
            digits(c["error"]),
            small(c["limit"]),
            c["note"],
            verdict(c),
        )
        for c in checks
    ]
    yield table(("value", "dForce", "expected", "unit", "digits", "limit", "note", ""), rows)


def _disagreements(checks: Sequence[Row]) -> str:
    if not any(check["source"] for check in checks):
        return table(("outcome", "cases"), [(check["name"], f"{check['found']:.0f}") for check in checks])
    rows = [(c["name"], small(c["error"]), small(c["limit"]), c["source"], c["note"], verdict(c)) for c in checks]
    return table(("quantity", "worst", "limit", "the worst case", "relative to; all cases", ""), rows)


def _pivot(part: Mapping[str, Any]) -> Iterable[str]:
    """Give a table with a row for each name and a column for each group."""
    groups = list(dict.fromkeys(check["group"] for check in part["checks"]))
    found = {(check["name"], check["group"]): check for check in part["checks"]}
    limits = {check["group"]: check["limit"] for check in part["checks"]}
    rows = [("limit", *(small(limits[group]) for group in groups))]
    for name in dict.fromkeys(check["name"] for check in part["checks"]):
        cells = (found.get((name, group)) for group in groups)
        rows.append((name, *(f"{small(cell['error'])} {verdict(cell)}".strip() if cell else "" for cell in cells)))
    yield table(("", *groups), rows)
    about = {check["group"]: check for check in part["checks"] if check["source"] or check["note"]}
    yield "\n".join(f"- {group}: {check['source']} ({check['note']})" for group, check in about.items())


def _cases(part: Mapping[str, Any]) -> Iterable[str]:
    if part["cases"]:
        yield "### The cases above"
        yield "Each is a complete case: save it to a file for `dforce run`."
        for name, text in part["cases"].items():
            yield f"{name[:1].upper()}{name[1:]}:"
            yield f"```toml\n{text.rstrip()}\n```"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table; columns without any text are left out."""
    rows = list(rows)
    kept = [i for i, word in enumerate(head) if any(row[i] for row in rows) or (word and not rows)]
    lines = [[head[i] for i in kept], ["---"] * len(kept), *([row[i] for i in kept] for row in rows)]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def verdict(check: Row) -> str:
    """Return nothing for a check that is met."""
    return "" if check["met"] else "**not met**"


def number(value: float | None) -> str:
    """Return a number with up to 13 digits."""
    return "" if value is None else f"{value:.13g}"


def small(value: float | None) -> str:
    """Return an error or a limit with two digits."""
    if value is None:
        return ""
    return f"{value:.2g}" if math.isfinite(value) else "∞"


def digits(error: float | None) -> str:
    """Return the decimal digits in which two numbers agree, as JSON may have brought the error."""
    if error is None or not math.isfinite(error):
        return "0"
    return "16" if error <= 1e-16 else f"{max(-math.log10(error), 0.0):.1f}"


def unit(text: str) -> str:
    """Return a unit as it is shown."""
    return "" if text == "1" else text
