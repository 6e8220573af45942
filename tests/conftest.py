"""Keep every test hermetic: Taichi's cache in a temporary folder, real recordings skipped where they are absent."""

from __future__ import annotations

import os
import signal
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

_CACHE = tempfile.TemporaryDirectory(prefix="tiegocancel-tests-")
os.environ["TI_OFFLINE_CACHE_FILE_PATH"] = str(Path(_CACHE.name) / "taichi")
os.environ["MPLCONFIGDIR"] = str(Path(_CACHE.name) / "matplotlib")
os.environ["MPLBACKEND"] = "Agg"
os.environ["PYTHONSAFEPATH"] = "1"  # programs started by a test import what the test imports, not the tree around them

# A shell starts what it sends to the background deaf to Ctrl-C, and tests of Ctrl-C would wait for ever.
signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("house", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("house")

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def repository() -> Path:
    """Root of the source tree; tests that read it skip when only the wheel is there."""
    if not (REPOSITORY / "pyproject.toml").exists():
        pytest.skip("the source tree is not here")
    return REPOSITORY


@pytest.fixture(scope="session")
def recording() -> Callable[[str], Path]:
    """Return the path of a real recording; skip where it is absent: they are not ours to redistribute."""

    def find(name: str) -> Path:
        path = REPOSITORY.parent / "shared" / "data" / name
        if not path.exists():
            pytest.skip(f"real recording ../shared/data/{name} is absent")
        return path

    return find
