"""Paths into a case: ``sample.youngs_modulus``, ``forces.dmt.hamaker``, ``cantilever.modes.2.Q``."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from typing import Any, TypeVar

from dforce.case._text import tables
from dforce.core.errors import LONGEST_LIST, ParameterError, shorten
from dforce.core.parameter_quantity import ParameterQuantity
from dforce.core.parameters import Parameters
from dforce.forces import Force

LISTS = {"cantilever": "modes", "drive": "tones"}  # a section may contain the keys of its only list entry
LONGEST = 200
P = TypeVar("P", bound=Parameters)


def changed(case: Parameters, assignments: Iterable[tuple[str, object]]) -> dict[str, Any]:
    """Return the tables of a case with values put at paths; nothing is validated but the paths.

    Raises
    ------
    ParameterError
        For a path that the case does not have, with the nearest one.
    """
    table = tables(case)
    for path, value in assignments:
        if not isinstance(path, str) or len(path) > LONGEST:
            raise ParameterError(f"{shorten(path)} is not the path of a parameter, such as sample.youngs_modulus")
        _put(case, case, table, _steps(case, path), value, "")
    return table


def quantity_at(case: Parameters, path: str) -> ParameterQuantity:
    """Return the declaration of the number at a path.

    Raises
    ------
    ParameterError
        For a path that the case does not have, with the nearest path, or that leads to no number with a unit.
    """
    changed(case, [(path, None)])  # raises the error on a wrong path
    owner: Any = case
    *steps, last = _steps(case, path)
    while steps:
        owner = getattr(owner, steps.pop(0))
        if isinstance(owner, tuple):
            owner = owner[_place(owner, steps.pop(0) if steps else last, path)]
    found = owner.quantities().get(last) if isinstance(owner, Parameters) else None
    if found is None:
        raise ParameterError(f"'{path}' is not a quantity, such as sample.youngs_modulus")
    return found


def value_at(case: Parameters, path: str) -> Any:
    """Return the value at a path.

    Raises
    ------
    ParameterError
        For a path that the case does not have, with the nearest one.
    """
    found: Any = case
    for step in place_of(case, path):
        found = getattr(found, step) if isinstance(step, str) else found[int(step)]
    return found


def place_of(case: Parameters, path: str) -> tuple[str | int, ...]:
    """Return the names and the places in lists by which a path leads to a value: the same for all paths that lead there.

    Raises
    ------
    ParameterError
        For a path that the case does not have, with the nearest one.
    """
    changed(case, [(path, None)])  # raises the error on a wrong path
    found: Any = case
    places: list[str | int] = []
    for step in _steps(case, path):
        if isinstance(found, tuple):
            number = _place(found, step, path)
            places.append(number)
            found = found[number]
        else:
            places.append(step)
            found = getattr(found, step)
    return tuple(places)


def with_number(case: P, path: str, value: float) -> P:
    """Return a copy of a case with a number at a path, without any check; it serves to build problems from."""
    copied: P = _copied(case, _steps(case, path), value, path)
    copied.__dict__.pop("problem", None)  # it belongs to the case before
    return copied


def _copied(owner: Any, steps: list[str], value: float, path: str) -> Any:
    first, *rest = steps
    new: Any = value
    if rest:
        child = getattr(owner, first)
        if isinstance(child, tuple):
            place = _place(child, rest[0], path)
            new = (*child[:place], _copied(child[place], rest[1:], value, path), *child[place + 1 :])
        else:
            new = _copied(child, rest, value, path)
    return owner.model_copy(update={first: new})


def paths(given: Parameters, prefix: str = "") -> Iterator[str]:
    """Yield every path that can be changed in a case: sections, lists' items and single values."""
    for key in given.keys():  # noqa: SIM118 the method of Parameters
        path = prefix + key
        yield path
        value = getattr(given, key)
        if isinstance(value, Parameters):
            yield from paths(value, f"{path}.")
        elif _is_list(value):
            for place, item in enumerate(value, start=1):
                yield f"{path}.{place}"
                yield from paths(item, f"{path}.{_name(value, item) or place}.")


def _is_list(value: object) -> bool:
    return isinstance(value, tuple) and bool(value) and isinstance(value[0], Parameters)


def _name(items: tuple[Parameters, ...], item: Parameters) -> str:
    """Return a force's name where it alone has it."""
    if not isinstance(item, Force):
        return ""
    return item.name if sum(isinstance(other, Force) and other.name == item.name for other in items) == 1 else ""


def _steps(case: Parameters, path: str) -> list[str]:
    """Return the steps of a path; a key of the only mode or tone gets the place where the case has it."""
    steps = path.split(".")
    listed = LISTS.get(steps[0])
    if listed is None or len(steps) < 2:
        return steps
    section = getattr(case, steps[0])
    items = getattr(section, listed)
    if len(steps) == 2 and items and steps[1] in type(items[0]).model_fields:
        if len(items) > 1:
            raise ParameterError(
                f"'{path}' could be any of {len(items)} {listed}; write for example {steps[0]}.{listed}.1.{steps[1]}"
            )
        return [steps[0], listed, "1", steps[1]]
    if len(steps) == 4 and steps[1:3] == [listed, "1"] and not items and steps[3] in section.model_fields_set:
        return [steps[0], steps[3]]
    return steps


def _put(case: Parameters, owner: object, table: dict[str, Any], steps: list[str], value: object, walked: str) -> None:
    first, rest = steps[0], steps[1:]
    path = walked + first
    if not isinstance(owner, Parameters):
        raise ParameterError(f"{walked.removesuffix('.')} is not a table in this case; it has no '{shorten(first)}'")
    if first not in owner.keys():  # noqa: SIM118 the method of Parameters
        raise ParameterError(f"the case has no parameter '{shorten(path)}'{_hint(case, owner, first, walked)}")
    if not rest:
        table[first] = value
        return
    child = getattr(owner, first)
    if isinstance(child, tuple) and (_is_list(child) or first in ("forces", *LISTS.values())):
        place = _place(child, rest[0], path)
        if len(rest) == 1:
            table[first][place] = value
        else:
            _put(case, child[place], table[first][place], rest[1:], value, f"{path}.{rest[0]}.")
    elif child is None:
        raise ParameterError(f"the case has no table [{path}]; write the table in the file, or set {path} as a whole")
    else:
        _put(case, child, table.setdefault(first, {}), rest, value, f"{path}.")


def _place(items: tuple[object, ...], step: str, path: str) -> int:
    """Return the index of an item by its number from 1, or of a force by its name."""
    names = [item.name for item in items if isinstance(item, Force)]
    if step in names:
        if names.count(step) > 1:
            numbers = [str(n) for n, name in enumerate(names, start=1) if name == step]
            raise ParameterError(
                f"'{path}.{step}' could be any of {path}.{f' and {path}.'.join(numbers)}; write one of them"
            )
        return names.index(step)
    if step.isdecimal() and len(step) < 4 and 1 <= int(step) <= len(items):
        return int(step) - 1
    close = difflib.get_close_matches(step[:LONGEST], names, n=1)
    hint = f"; did you mean '{path}.{close[0]}'?" if close else f"; it has {len(items)} of them, counted from 1"
    raise ParameterError(f"the case has no '{shorten(f'{path}.{step}')}'{hint}")


def _hint(case: Parameters, owner: Parameters, step: str, walked: str) -> str:
    """Return the nearest path: a neighbor with a similar name, or the same name elsewhere in the case."""
    if step in owner.hints:
        return f"; {owner.hints[step]}"
    same = [key for key in owner.keys() if key.casefold() == step.casefold()]  # noqa: SIM118 the method of Parameters
    close = same or difflib.get_close_matches(step, owner.keys(), n=1)
    if close:
        return f"; did you mean '{walked}{close[0]}'?"
    elsewhere = [path for path in paths(case) if path.split(".")[-1] == step]
    if elsewhere:
        return "; did you mean " + " or ".join(f"'{path}'" for path in elsewhere[:3]) + "?"
    listed = ", ".join(sorted(walked + key for key in owner.keys()))  # noqa: SIM118
    return f"; known: {listed}" if len(listed) <= LONGEST_LIST else "; dforce schema lists all"
