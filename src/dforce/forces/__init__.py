"""Tip–sample forces: one file, one model.

The models are found by looking through this folder, so that a new file is all that a new force takes:
``dforce.forces.DMT`` is the class of ``dmt.py``, and ``REGISTRY["dmt"]`` the same by its key in a case.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import Any

from dforce.errors import nearest
from dforce.forces._force import INTERACTIONS, REGISTRY, Force

for _file in pkgutil.iter_modules(__path__):
    if not _file.name.startswith("_"):
        importlib.import_module(f"{__name__}.{_file.name}")

_models = {model.__name__: model for model in REGISTRY.values()}
globals().update(_models)
__all__ = ["INTERACTIONS", "REGISTRY", "Force", *sorted(_models)]


def __getattr__(name: str) -> Any:
    """Answer an unknown model with the nearest known one."""
    raise AttributeError(f"dforce.forces has no model '{name}'{nearest(name, _models)}")
