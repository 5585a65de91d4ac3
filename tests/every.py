"""A claim about many like cases as one test, which names all cases that break it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def every(
    cases: Iterable[Any], name: Callable[[Any], str] = str
) -> Callable[[Callable[..., None]], Callable[[], None]]:
    """Make one test of a check on each case; a case that is a tuple is passed as several arguments.

    Parameters
    ----------
    cases
        All cases; at least one.
    name
        Names a case where it fails.
    """
    each = list(cases)
    assert each, "a claim about no case at all cannot fail"

    def made(check: Callable[..., None]) -> Callable[[], None]:
        def test() -> None:
            failed = []
            for case in each:
                try:
                    check(*case) if isinstance(case, tuple) else check(case)
                except (Exception, pytest.fail.Exception) as error:  # every kind is a case that breaks the claim  # noqa: BLE001
                    failed.append(f"{name(case)}: {type(error).__name__}: {error}")
            assert not failed, f"{len(failed)} of {len(each)}:\n" + "\n".join(failed)

        test.__name__, test.__module__, test.__qualname__ = check.__name__, check.__module__, check.__qualname__
        return test

    return made
