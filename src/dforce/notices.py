"""What dForce says while it works, beside results and errors."""

from __future__ import annotations

import sys


def announce(text: str) -> None:
    """Print a sentence on the error stream; a program around dForce puts its own function in this place."""
    print(text, file=sys.stderr, flush=True)
