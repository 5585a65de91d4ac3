"""Runs the command ``dforce`` as ``python -m dforce``."""

from dforce.cli import main

main()
