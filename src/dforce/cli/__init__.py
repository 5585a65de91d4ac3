"""The command line: one file, one command."""

import sys

from dforce.core.stopping import look, sigterm_as_ctrl_c


def main() -> None:
    """Run the program; the entry point of the console script. A stop is heard while the program is still loading."""
    try:
        with sigterm_as_ctrl_c(ends_program=True):
            from dforce.cli import _streams
            from dforce.cli.app import app

            look()  # a stop that came while these were imported had to wait
            with _streams.careful():
                app()
    except KeyboardInterrupt:
        from dforce.cli._terminal import STOPPED, say

        say("dforce: stopped")
        sys.exit(STOPPED)
