"""The engine's compiled functions, kept on disk with the user's other compiled code."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dforce.kernel import Kernel, cache

ENGINE = ("tableau", "laws", "lanes", "step", "events", "sums", "advance")


@functools.cache
def entry(name: str, what: str, sources: tuple[str, ...]) -> Callable[..., None]:
    """Return a function of the last of some files of this folder; its first call compiles it or loads it from disk.

    The hash of all these files names its module: the code lasts until one of them changes.
    """
    texts = [Path(__file__).with_name(f"{source}.py").read_bytes() for source in sources]
    stamp = hashlib.sha256(b"\0".join(texts)).hexdigest()
    kernel: Any = Kernel(cache.load(f"# {stamp}\n{texts[-1].decode()}"), what)
    return kernel.entry(name)  # type: ignore[no-any-return]
