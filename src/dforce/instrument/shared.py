"""The instrument's values that forces share: which there are, who reads which, and a force with them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from dforce.core.errors import ForceError, ParameterError, checked, nearest
from dforce.core.parameters import Parameters
from dforce.forces import Force
from dforce.instrument import Contact, Medium, ModeNumbers, Sample, Tip, effective_modulus


def instrument_values(
    modes: tuple[ModeNumbers, ...], tip: Tip, sample: Sample, contact: Contact, medium: Medium
) -> dict[str, float | None]:
    """Return the SI values that forces may share, by path; None where the user set none.

    The cantilever's values are of mode 1. A tip without a Young's modulus is rigid: its modulus is infinite.
    """
    sections: dict[str, Parameters] = {"tip": tip, "sample": sample, "contact": contact, "medium": medium}
    values: dict[str, float | None] = {
        f"{section}.{name}": getattr(given, name) for section, given in sections.items() for name in given.quantities()
    }
    values |= {f"cantilever.{name}": getattr(modes[0], name) for name in ("f0", "k", "Q")}
    values["contact.E_eff"] = effective_modulus(tip, sample)
    if tip.youngs_modulus is None:
        values["tip.youngs_modulus"] = math.inf
    return values


DERIVED = {
    "contact.E_eff": ("tip.youngs_modulus", "tip.poisson_ratio", "sample.youngs_modulus", "sample.poisson_ratio")
}  # the values that :func:`instrument_values` derives from a user's values


@checked
def values_used(models: Iterable[type[Force]]) -> frozenset[str]:
    """Return the paths of the instrument's values that force models read, such as ``tip.radius``."""
    paths = {path for model in models for path in model.shared_fields().values()}
    return frozenset(given for path in paths for given in DERIVED.get(path, (path,)))


def with_values(force: Force, values: Mapping[str, float | None]) -> Force:
    """Return a force with the instrument's values.

    Parameters
    ----------
    force
        A force of the user.
    values
        The result of :func:`instrument_values`.

    Raises
    ------
    ForceError
        When it takes a value that no instrument has.
    ParameterError
        When a value is missing (the error names its place), or is too small or large to compute with.
    """
    paths = list(force.shared_fields().values())
    for path in paths:
        if path not in values:
            hint = nearest(path, values)
            raise ForceError(f"{force.name} takes '{path}' from the instrument, but it has no such value{hint}")
    try:
        return force.bind(values)
    except ParameterError as error:
        for path in paths:
            if values[path] is None and f"{path}, which is missing" in str(error):
                raise ParameterError(_missing(force.name, path)) from None
        raise
    except ArithmeticError:
        raise ParameterError(
            f"{force.name} cannot be computed with these values: one is too small or too large"
        ) from None


def _missing(name: str, path: str) -> str:
    wanted = "sample.youngs_modulus" if path == "contact.E_eff" else path
    section, key = wanted.split(".")
    if section == "medium":
        return f'{name} needs {wanted}, which is missing; write medium = "water" or {key} under [medium]'
    return f"{name} needs {wanted}, which is missing; write {key} under [{section}]"
