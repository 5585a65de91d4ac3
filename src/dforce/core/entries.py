"""Parts of dForce that other packages bring, by their entry points."""

from __future__ import annotations

import importlib.metadata
from typing import TypeVar

from dforce.core import log
from dforce.core.errors import shorten

T = TypeVar("T")


def loaded(group: str, kind: type[T], noun: str) -> list[T]:
    """Return the objects of one kind that the entry points of a group name; a broken package is announced and left out."""
    found = []
    for entry in importlib.metadata.entry_points(group=group):
        try:
            one = entry.load()
            if not isinstance(one, kind):
                raise TypeError(f"it is no {kind.__name__}")
        except Exception as error:  # a broken package must not take the others with it  # noqa: BLE001
            log.announce(
                f"The {noun} '{entry.name}' ({entry.value}) cannot be loaded: "
                f"{type(error).__name__}: {shorten(str(error), 200)}"
            )
        else:
            found.append(one)
    return found
