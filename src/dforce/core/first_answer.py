"""Whether an answer may come before its code is compiled for its own combination of forces.

It does where a person waits for it: in the window, and in `dforce run`. Everywhere else, and in every sweep, the code of the
combination alone computes, so that the same call gives the same bits whether it is the first one or not.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from contextvars import ContextVar

from dforce.core.errors import ParameterError

VARIABLE = "DFORCE_FIRST_ANSWER"
WAYS = ("early", "full")

_early: ContextVar[bool] = ContextVar("early", default=False)


@contextlib.contextmanager
def early_answers() -> Iterator[None]:
    """Let what is solved while the context lasts be computed with forces called by their address.

    Unless the environment variable `DFORCE_FIRST_ANSWER` is ``full``.

    Raises
    ------
    ParameterError
        When it is anything else but ``early``.
    """
    token = _early.set(may_go_on_beside())
    try:
        yield
    finally:
        _early.reset(token)


def may_be_early() -> bool:
    """Say whether an answer may come early, here and now."""
    return _early.get()


def may_go_on_beside() -> bool:
    """Say whether processes of their own may compile: not where ``DFORCE_FIRST_ANSWER`` is ``full``.

    Raises
    ------
    ParameterError
        When it is anything else but ``early``.
    """
    way = os.environ.get(VARIABLE) or WAYS[0]
    if way not in WAYS:
        raise ParameterError(f"the environment variable {VARIABLE} is '{way}'; it may be {' or '.join(WAYS)}")
    return way == WAYS[0]
