"""How a benchmark ends: with its own exit status, or with 130 behind Ctrl-C or SIGTERM. Lines printed before stay."""

from __future__ import annotations

import sys
from collections.abc import Callable

from dforce.core.stopping import sigterm_as_ctrl_c

STOPPED = 130


def end_with(main: Callable[[], int | None]) -> None:
    """Call the main function of a program, and exit with the status that it returns."""
    try:
        with sigterm_as_ctrl_c(ends_program=True):
            status = main()
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        status = STOPPED
    sys.exit(status)
