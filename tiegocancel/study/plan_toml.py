"""Write a configuration of the canceller as the TOML that ``run --config`` takes."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from typing import Any

from tiegocancel.matching.config import CancelConfig

__all__ = ["cancel_toml"]


def cancel_toml(config: CancelConfig, *, remarks: Sequence[str] = ()) -> str:
    """Return the table ``[cancel]`` under ``remarks`` as comments; what is ``None`` is left out, as its default is.

    Filling the settings from it gives ``config`` again.
    """
    lines = [f"# {' '.join(remark.split())}" for remark in remarks] + ["[cancel]"]
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if value is not None:
            lines.append(f"{field.name} = {_value(value)}")
    return "\n".join(lines) + "\n"


def _value(value: Any) -> str:
    """Return a number, a word or a list of numbers."""
    return json.dumps(list(value) if isinstance(value, tuple) else value)
