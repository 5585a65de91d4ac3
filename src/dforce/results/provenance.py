"""Where a result comes from: its case, versions, platform and date."""

from __future__ import annotations

import datetime
import functools
import importlib.metadata
import os
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from dforce.core.errors import ParameterError
from dforce.forces import Force, code_of

if TYPE_CHECKING:
    import xarray as xr

PLUGINS = "plugins_sha256"  # attributes of results with force models that dForce does not ship
FOLDER = "plugins_folder"

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


class Described(Protocol):
    """The part of a case that a result contains."""

    @property
    def title(self) -> str:
        """Its title."""

    @property
    def forces(self) -> Sequence[Force]:
        """Its forces."""

    @property
    def plugins(self) -> Sequence[str]:
        """The files of force models that it names."""

    @property
    def folder(self) -> Path | None:
        """Where these files are."""

    def to_toml(self, complete: bool = False) -> str:
        """Return its text."""


def of_case(case: Described, text: str = "", title: str = "") -> dict[str, str]:
    """Return the attributes of a result of a case: all of :func:`provenance`, and of its plug-ins."""
    return provenance(text or case.to_toml(complete=True), title or case.title) | of_plugins(case)


def of_plugins(case: Described) -> dict[str, str]:
    """Return the hash and the folder of the plug-ins of a case, as attributes; nothing without plug-ins."""
    code = code_of(case.forces)
    return ({PLUGINS: code} if code else {}) | (
        {FOLDER: _from_home(case.folder)} if case.plugins and case.folder else {}
    )


def folder_of_plugins(attrs: Mapping[Any, Any]) -> Path | None:
    """Return the folder of the plug-ins of a result from its attributes; None without plug-ins."""
    return Path(_expanded(attrs[FOLDER])) if FOLDER in attrs else None


def _expanded(folder: str) -> str:
    return os.path.expanduser(folder)  # noqa: PTH111 - the method of Path fails for a user without a home


def _from_home(folder: Path) -> str:
    """Return a folder from "~" on, so that a result that is passed on does not show the name of the user."""
    home = Path(_expanded("~")).resolve()
    return str(Path("~", folder.relative_to(home))) if folder.is_relative_to(home) else str(folder)


def check_plugins(case: Described, result: xr.Dataset) -> None:
    """Refuse a result that was computed with other code of the plug-ins of its case.

    Raises
    ------
    ParameterError
        When a plug-in, or an array in it, has changed.
    """
    code = code_of(case.forces)
    if result.attrs.get(PLUGINS, code) != code:
        raise ParameterError("a force model of your own has changed since this result; compute the result anew")


@functools.cache  # reading them anew takes as long as solving a curve
def _surroundings() -> dict[str, str]:
    """Return the versions and the platform of this process."""
    packages = ("dforce", "numpy", "numba", "scipy")
    versions = {f"{name}_version": importlib.metadata.version(name) for name in packages}
    return versions | {"python_version": platform.python_version(), "platform": platform.platform()}
