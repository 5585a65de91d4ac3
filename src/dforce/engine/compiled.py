"""The compiled engine, kept on disk with the user's other compiled code: one module, named by the hash of all its sources."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dforce.kernel import Kernel, cache

SOURCES = ("tableau", "laws", "lanes", "step", "events", "sums", "advance")


@functools.cache
def engine() -> Callable[..., None]:
    """Return ``advance.advance``; its first call compiles it or loads it from disk."""
    texts = [Path(__file__).with_name(f"{name}.py").read_bytes() for name in SOURCES]
    stamp = hashlib.sha256(b"\0".join(texts)).hexdigest()
    kernel: Any = Kernel(cache.load(f"# {stamp}\n{texts[-1].decode()}"), "the engine")
    return kernel.entry("advance")  # type: ignore[no-any-return]
