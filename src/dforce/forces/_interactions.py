"""Forces with the same interaction, which a sum of forces must not contain twice."""

from __future__ import annotations

from collections.abc import Sequence

from dforce.core.errors import ParameterError
from dforce.forces._contract import REGISTRY, Force


def refuse_double_counting(forces: Sequence[Force]) -> None:
    """Raise :class:`ParameterError` when two forces have the same interaction."""
    for i, second in enumerate(forces):
        for first in forces[:i]:
            common = [interaction for interaction in first.contains if interaction in second.contains]
            if common:
                both = f"{first.name} and {second.name} both contain {' and '.join(common)}"
                if first.name == second.name:
                    both = f"{first.name} appears twice"
                raise ParameterError(f"{both}; {_what_to_remove(first, second, common)}")


def _what_to_remove(first: Force, second: Force, common: list[str]) -> str:
    for whole, part in ((first, second), (second, first)):
        if len(part.contains) == len(common):
            return f"remove {'one of them' if len(whole.contains) == len(common) else part.name}"
    for mixed, other in ((second, first), (first, second)):
        rest = {interaction for interaction in mixed.contains if interaction not in common}
        simpler = next(
            (name for name, model in REGISTRY.items() if model.contains and set(model.contains) == rest), None
        )
        if simpler is not None:
            return f"beside {other.name}, replace {mixed.name} by {simpler}"
    return "remove one of them"
