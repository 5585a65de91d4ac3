"""How often Python looks for garbage."""

from __future__ import annotations

import contextlib
import gc
from collections.abc import Iterator

SELDOM = 100_000  # new objects between two looks


@contextlib.contextmanager
def seldom_collected() -> Iterator[None]:
    """Look for garbage less often, where nearly all objects stay: modules that are loaded, and what the compiler makes.

    To look through them again and again takes a tenth of the time.
    """
    before = gc.get_threshold()
    gc.set_threshold(max(SELDOM, before[0]) if before[0] else 0, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)
