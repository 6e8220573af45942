"""Write down what produced a result: version, configuration, inputs, numbers."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import tiegocancel

__all__ = ["input_record", "plain", "write_manifest"]

_BLOCK_BYTES = 1 << 20


def write_manifest(
    path: Path,
    *,
    command: list[str],
    settings: Any,
    inputs: list[dict[str, Any]],
    outputs: list[str],
    results: dict[str, Any],
) -> None:
    """Write the manifest: enough to run the same thing again and to see that it was the same.

    ``inputs`` come from :func:`input_record`, ``outputs`` are names beside the manifest.
    """
    manifest = {
        "tiegocancel": tiegocancel.__version__,
        "commit": _commit(),
        "command": command,
        "settings": plain(settings),
        "inputs": inputs,
        "outputs": outputs,
        "versions": {"python": platform.python_version(), **_versions("taichi", "numpy", "scipy", "matplotlib")},
        "machine": platform.machine(),
        "results": results,
    }
    text = json.dumps(manifest, indent=2, ensure_ascii=False) + "\n"
    path.write_text(text, encoding="utf-8", errors="backslashreplace")


def input_record(path: Path) -> dict[str, Any]:
    """Return path, size in bytes and SHA-256 of an input."""
    return {"path": str(path), "bytes": path.stat().st_size, "sha256": _sha256(path)}


def plain(value: Any) -> Any:
    """Turn nested dataclasses into tables that JSON holds."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def _commit() -> str | None:
    """Return the commit when the package runs from its own source tree, else ``None``."""
    tree = Path(tiegocancel.__file__).resolve().parent.parent
    if not (tree / ".git").exists():
        return None
    try:
        asked = subprocess.run(
            ["git", "-C", str(tree), "describe", "--always", "--dirty", "--abbrev=40"],
            capture_output=True,
            text=True,
            timeout=5,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return asked.stdout.strip() or None


def _versions(*packages: str) -> dict[str, str]:
    found = {}
    for package in packages:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def _sha256(path: Path) -> str:
    """Hash a file block by block."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(_BLOCK_BYTES):
            digest.update(block)
    return digest.hexdigest()
