"""Keep the results of a sweep in one file that only grows, so that a kill at any moment loses nothing that was done."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

from tiegocancel.errors import ConfigError, InputError
from tiegocancel.study.sweep.job import Job, Row, canonical

__all__ = ["ResultStore"]


class ResultStore:
    """Append rows to ``path``, a JSON object a line: ``key``, ``job``, ``row``.

    A line is written whole or is torn at the end of the file, where a kill came between: a torn end is cut off when the
    file is opened again, and its job runs again. One process at a time may have it open. Raise ``InputError`` for a
    file that holds anything else.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: dict[str, Row] = {}
        try:
            self._file: BinaryIO = path.open("a+b")
        except OSError as error:
            raise ConfigError(f"{path}: {error.strerror or error}") from error
        try:
            self._lock()
            self._read()
        except BaseException:
            self._file.close()
            raise

    def add(self, results: Iterable[tuple[str, Job, Row]]) -> None:
        """Append results (key, job, row) and see them onto the disk; a key that is there already is left alone."""
        lines = []
        for key, job, row in results:
            if key not in self.rows:
                self.rows[key] = row
                lines.append(canonical({"key": key, "job": dict(job), "row": row}) + "\n")
        if lines:
            self._file.write("".join(lines).encode("ascii"))
            self._file.flush()
            os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file; the lock goes with it."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _lock(self) -> None:
        """Refuse a file that another process has open; where the system has no such locks, trust the user."""
        with contextlib.suppress(ImportError):
            import fcntl

            try:
                fcntl.flock(self._file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise ConfigError(f"{self.path}: another sweep is writing there") from None

    def _read(self) -> None:
        """Read what is there; cut off a torn end."""
        self._file.seek(0)
        whole = 0
        for number, line in enumerate(self._file, 1):
            if not line.endswith(b"\n"):
                break
            try:
                entry: Any = json.loads(line)
                self.rows.setdefault(str(entry["key"]), dict(entry["row"]))
            except (ValueError, KeyError, TypeError) as error:
                raise InputError(self.path, f"line {number}", f"is no result of a sweep: {error}") from None
            whole += len(line)
        self._file.truncate(whole)
        self._file.seek(0, os.SEEK_END)
