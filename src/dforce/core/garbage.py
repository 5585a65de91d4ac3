"""How often Python looks for garbage."""

from __future__ import annotations

import contextlib
import gc
from collections.abc import Iterator

SELDOM = 100_000  # new objects between two looks


@contextlib.contextmanager
def seldom_collected() -> Iterator[None]:
    """Collect garbage less often, where nearly all objects stay: while modules are loaded, and in a compilation.

    Collections would take a tenth of the time.
    """
    before = gc.get_threshold()
    gc.set_threshold(max(SELDOM, before[0]) if before[0] else 0, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)
