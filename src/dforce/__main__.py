"""Lets ``python -m dforce`` do what the command ``dforce`` does."""

from dforce.cli import main

main()
