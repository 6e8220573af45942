"""Name a job by what it is: the same configuration on the same data has the same key, today and after a crash."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

__all__ = ["Job", "Row", "canonical", "job_key"]

Job = Mapping[str, Any]
"""A configuration: names to values that JSON holds."""

Row = dict[str, Any]
"""What a job gave: names to values that JSON holds."""

_KEY_DIGITS = 24


def canonical(value: Any) -> str:
    """Return the one JSON text of a value: sorted keys, no spaces; raise ``TypeError`` for what JSON does not hold."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=True)


def job_key(job: Job, basis: str) -> str:
    """Return the key of ``job``; ``basis`` names the data and the code that it runs on."""
    text = canonical({"basis": basis, "job": dict(job)})
    return hashlib.sha256(text.encode("ascii")).hexdigest()[:_KEY_DIGITS]
