"""The command line: one verb, one file."""

from tiegocancel.cli.main import main

__all__ = ["main"]
