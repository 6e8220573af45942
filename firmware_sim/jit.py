"""Compile the simulator's loops with numba where it is installed; without it they run as they are, much slower."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

__all__ = ["is_compiled", "jit"]

_Function = TypeVar("_Function", bound=Callable[..., Any])


def is_compiled() -> bool:
    """Tell whether loops are compiled: whether numba (extra ``budget``) is installed and not switched off."""
    return importlib.util.find_spec("numba") is not None and os.environ.get("NUMBA_DISABLE_JIT", "0") != "1"


def jit(function: _Function) -> _Function:
    """Return the function compiled; machine code is kept in the temporary folder unless ``NUMBA_CACHE_DIR`` is set."""
    if not is_compiled():
        return function
    os.environ.setdefault("NUMBA_CACHE_DIR", str(Path(tempfile.gettempdir()) / f"tiegocancel-numba-{_edition()}"))
    import numba

    # Loops are handed some forty arrays and allocate none: counting references to them at every call of a helper would
    # take nine tenths of the time.
    options: dict[str, Any] = {"cache": True, "nogil": True, "_nrt": False}
    made: _Function = numba.njit(**options)(function)
    return made


@cache
def _edition() -> str:
    """Return a name for user and sources: numba looks at a loop's own file only, and not at what it calls."""
    owner = os.getuid() if hasattr(os, "getuid") else "user"
    stamps = [
        (path.name, path.stat().st_mtime_ns, path.stat().st_size)
        for path in sorted(Path(__file__).parent.rglob("*.py"))
    ]
    return f"{owner}-{hashlib.sha256(repr(stamps).encode()).hexdigest()[:16]}"
