"""Values of an object that are computed once, when they are first asked for."""

from __future__ import annotations

import functools
from typing import Any, TypeVar

T = TypeVar("T")


class lazy_property(functools.cached_property[T]):
    """A cached property that threads compute beside each other.

    In Python 3.11 ``functools.cached_property`` computes for one object of a class at a time. Other threads would wait for the
    compilation of another run, and not show it.
    """

    def __get__(self, instance: Any, owner: type[Any] | None = None) -> Any:
        """Return the value, computed at the first call."""
        if instance is None:
            return self
        if self.attrname not in instance.__dict__:
            instance.__dict__[self.attrname] = self.func(instance)
        return instance.__dict__[self.attrname]
