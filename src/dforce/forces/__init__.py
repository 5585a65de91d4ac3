"""Tip–sample forces: one file, one model.

dForce finds the models in this folder: a new force needs only a new file. ``dforce.forces.DMT`` is the class of ``dmt.py``,
and ``REGISTRY["dmt"]`` the same by its key in a case. Models of other packages follow, by their entry points in the group
"dforce.forces".
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import Any

from dforce.core.entries import loaded
from dforce.core.errors import nearest
from dforce.forces._contract import INTERACTIONS, REGISTRY, Force, guarded, in_first_contact, makes_its_laws
from dforce.forces._interactions import grouped, refuse_double_counting
from dforce.forces._layer import kernel_moments
from dforce.forces._plugins import check_answers, code_of, load_plugin, read_by, read_plugin
from dforce.forces._rheology import Viscoelastic

for _file in pkgutil.iter_modules(__path__):
    if not _file.name.startswith("_"):
        importlib.import_module(f"{__name__}.{_file.name}")

loaded("dforce.forces", object, "force plug-in")

_models = {model.__name__: model for model in REGISTRY.values()}
globals().update(_models)
__all__ = [  # noqa: PLE0604
    "INTERACTIONS",
    "REGISTRY",
    "Force",
    "Viscoelastic",
    "check_answers",
    "code_of",
    "grouped",
    "guarded",
    "in_first_contact",
    "kernel_moments",
    "load_plugin",
    "makes_its_laws",
    "read_by",
    "read_plugin",
    "refuse_double_counting",
    *sorted(_models),
]


def __getattr__(name: str) -> Any:
    """Answer an unknown model with the nearest known one."""
    raise AttributeError(f"dforce.forces has no model '{name}'{nearest(name, _models)}")


def __dir__() -> list[str]:
    """Return the classes of forces and their helpers, without the modules of this folder."""
    return __all__
