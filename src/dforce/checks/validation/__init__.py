"""Results of dForce, checked against published equations, exact balances and independent integrators."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from dforce.checks.validation.page import validation_page
from dforce.core.errors import checked

__all__ = ["validate", "validation_page"]


@checked
def validate(quick: bool = False, progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Run every check of dForce against published values and independent solvers, and return the results.

    Parameters
    ----------
    quick
        Only checks that take seconds with compiled kernels: fewer random cases, over the forces of the shipped examples.
    progress
        Called with the name of the next check.

    Returns
    -------
    dict
        `parts`: a list with `name`, `title`, `text`, `met`, `checks` and `cases` (files of the named random cases). A check has
        `group`, `name`, `found`, `expected` (None for a disagreement), `unit` (SI), `error` (relative to the named size),
        `limit` (None if only reported), `source`, `note` and `met`. Also `met`, `quick`, `seconds` and `machine`.
        :func:`validation_page` makes a page of this dict.
    """
    from dforce.checks.machine import machine
    from dforce.checks.validation import closed_forms, curves, disagreements, identities, orders, published
    from dforce.checks.validation.checks import ValidationPart, as_table

    tell, start = progress or (lambda text: None), time.perf_counter()
    steps: tuple[tuple[str, Callable[[], ValidationPart]], ...] = (
        ("published values", lambda: published.part(quick)),
        ("identities", lambda: identities.part(quick)),
        ("closed forms", lambda: closed_forms.part(quick)),
        ("orders of convergence", lambda: orders.part(quick)),
        ("random cases", lambda: disagreements.part(quick, tell)),
        ("curves", lambda: curves.part(quick, tell)),
    )
    parts = []
    for name, make in steps:
        tell(name)
        parts.append(make())
    return {
        "parts": as_table(tuple(parts)),
        "met": not any(part.missed for part in parts),
        "quick": quick,
        "seconds": time.perf_counter() - start,
        "machine": machine(),
    }
