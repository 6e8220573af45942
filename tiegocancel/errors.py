"""Errors that a user can cause; each is one clear line, and the command line maps it to an exit code."""

from __future__ import annotations

from pathlib import Path


class TiegoCancelError(Exception):
    """Root of every error that the package raises on purpose (exit code 1)."""


class ConfigError(TiegoCancelError):
    """Report a setting, flag or combination that cannot work (exit code 2)."""


class InputError(TiegoCancelError):
    """Report a fault in an input file: where it is, what was found, what was expected (exit code 1).

    ``where`` names the place: ``byte 512``, ``row 17``, ``field 'width'``; empty when the whole file is meant.
    """

    def __init__(self, path: str | Path, where: str, problem: str) -> None:
        self.path = str(path)
        self.where = where
        self.problem = problem
        super().__init__(": ".join(part for part in (self.path, where, problem) if part))


class LinkError(TiegoCancelError):
    """Report a fault of a link or a device at its end: which one, what happened (exit code 1)."""

    def __init__(self, port: str, problem: str) -> None:
        self.port = port
        self.problem = problem
        super().__init__(f"{port}: {problem}" if port else problem)


class MissingExtraError(TiegoCancelError):
    """Report an optional package that a task needs, with the extra that installs it (exit code 1)."""

    def __init__(self, task: str, package: str, extra: str) -> None:
        super().__init__(f"{task} needs the package {package}: pip install 'tiegocancel[{extra}]'")
