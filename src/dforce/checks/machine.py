"""The machine and the versions that a figure was measured with."""

from __future__ import annotations

import importlib.metadata
import os
import platform


def machine() -> dict[str, str]:
    """Return platform, processor, cores and versions, as words."""
    versions = {name: importlib.metadata.version(name) for name in ("dforce", "numpy", "numba", "scipy")}
    return {
        "platform": platform.platform(),
        "processor": platform.processor() or platform.machine(),
        "cores": str(os.cpu_count()),
        "python": platform.python_version(),
        **versions,
    }
