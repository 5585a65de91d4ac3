"""The command line: one file, one command."""

from dforce.cli._app import app, main

__all__ = ["app", "main"]
