"""Keep the folder of a run: its own files in it, the input's files out of it, and the list of both."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Any

from tiegocancel.errors import ConfigError
from tiegocancel.report.manifest import input_record, write_manifest

__all__ = ["OutputFolder"]

_MANIFEST = "manifest.json"


class OutputFolder:
    """Write into ``path`` what one run makes.

    ``inputs`` are recorded with their checksums as they were before, ``command`` as it was given; ``keep_clear`` names
    files that the run will write and that must not be among its inputs.
    """

    def __init__(self, path: Path, inputs: list[Path], *, command: list[str], keep_clear: list[str]) -> None:
        self.path, self._command = path, command
        self._inputs = inputs
        self._records: list[dict[str, Any]] = []
        self._written: list[str] = []
        self._keep_clear = [*keep_clear, *(f"{name}.labels.npy" for name in keep_clear), _MANIFEST, "report.html"]

    def prepare(self) -> None:
        """Make the folder, refuse to overwrite an input, remove what an earlier run left, hash the inputs."""
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except (FileExistsError, NotADirectoryError) as error:
            raise ConfigError(f"--out {self.path}: a file of that name is in the way") from error
        for name in self._keep_clear:
            for file in self._inputs:
                target = self.path / name
                if target.exists() and target.samefile(file):
                    raise ConfigError(f"--out {self.path}: {name} there is the input itself, and would be overwritten")
        self._remove_earlier()
        self._records = [input_record(file) for file in self._inputs]

    def file(self, name: str) -> Path:
        """Return the path of a file that this run writes, and remember it."""
        if name not in self._written:
            self._written.append(name)
        return self.path / name

    def write_manifest(self, settings: Any, results: dict[str, Any]) -> None:
        """Write ``manifest.json``: what was run, on what, with what result, into which files."""
        write_manifest(
            self.path / _MANIFEST,
            command=self._command,
            settings=settings,
            inputs=self._records,
            outputs=sorted(self._written),
            results=results,
        )

    def _remove_earlier(self) -> None:
        """Remove the files that an earlier manifest lists, so that no stale picture stands beside a new number."""
        manifest = self.path / _MANIFEST
        try:
            outputs = json.loads(manifest.read_text(encoding="utf-8"))["outputs"]
            names = [name for name in outputs if isinstance(name, str) and Path(name).name == name]
        except (OSError, ValueError, KeyError, TypeError):
            return
        for name in [*names, _MANIFEST]:
            earlier = self.path / name
            if earlier.is_file() and not any(earlier.samefile(file) for file in self._inputs):
                with contextlib.suppress(OSError):
                    earlier.unlink()
