"""Where a result comes from: its case, versions, platform and date."""

from __future__ import annotations

import datetime
import functools
import importlib.metadata
import platform
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass

# ends the sentence on a result that is to be continued with another case
OTHER_CASE = "load its own by df.load_case(FILE), or write to another file without resume"


def provenance(case: str, title: str = "") -> dict[str, str]:
    """Return the attributes that say where a result comes from.

    Parameters
    ----------
    case
        The whole case as TOML text; ``dforce run OUT.nc`` repeats the run from it.
    title
        Title of the case.
    """
    date = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    return {"title": title, "case": case, **_surroundings(), "date": date}


@functools.cache  # reading them anew takes as long as solving a curve
def _surroundings() -> dict[str, str]:
    """Return the versions and the platform of this process."""
    packages = ("dforce", "numpy", "numba", "scipy")
    versions = {f"{name}_version": importlib.metadata.version(name) for name in packages}
    return versions | {"python_version": platform.python_version(), "platform": platform.platform()}
