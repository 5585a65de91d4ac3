"""Where a result comes from: its case, versions, platform and date."""

from __future__ import annotations

import datetime
import functools
import importlib.metadata
import platform
from collections.abc import Iterable
from typing import TYPE_CHECKING

from dforce.core.errors import ParameterError
from dforce.forces import Force, code_of

if TYPE_CHECKING:
    import xarray as xr

PLUGINS = "plugins_sha256"  # attribute of results

# ends the sentence on a result that is to be continued with another case
OTHER_CASE = "load its own by df.load_case(FILE), or write to another file without resume"


def provenance(case: str, title: str = "") -> dict[str, str]:
    """Return the attributes for the origin of a result.

    Parameters
    ----------
    case
        The whole case as TOML text; ``dforce run OUT.nc`` repeats the run from it.
    title
        Title of the case.
    """
    date = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    return {"title": title, "case": case, **_surroundings(), "date": date}


def of_plugins(forces: Iterable[Force]) -> dict[str, str]:
    """Return the attribute with the hash of the plug-ins of some forces; nothing without plug-ins."""
    code = code_of(forces)
    return {PLUGINS: code} if code else {}


def check_plugins(forces: Iterable[Force], resume: xr.Dataset) -> None:
    """Refuse to continue a result that was computed with other code of its plug-ins.

    Raises
    ------
    ParameterError
        When a plug-in, or an array in it, has changed.
    """
    code = code_of(forces)
    if resume.attrs.get(PLUGINS, code) != code:
        raise ParameterError(
            "a plug-in of this result has changed; compute it anew, or write to another file without resume"
        )


@functools.cache  # reading them anew takes as long as solving a curve
def _surroundings() -> dict[str, str]:
    """Return the versions and the platform of this process."""
    packages = ("dforce", "numpy", "numba", "scipy")
    versions = {f"{name}_version": importlib.metadata.version(name) for name in packages}
    return versions | {"python_version": platform.python_version(), "platform": platform.platform()}
