"""Name the columns of the summary."""

from __future__ import annotations

__all__ = ["COLUMNS", "counted"]

COLUMNS = {
    "printed": "as printed",
    "printed_off": "own off",
    "cut": "(4.4), pairs",
    "gated": "(4.4), own off, lead",
    "zero": "control: zero motion",
    "stream": "streaming",
}
"""Series of the summary's columns: the first three on windows that were cut out, as the thesis did, the rest with what
comes before them."""


def counted(name: str) -> str:
    """Return what a column counts: events that were suppressed, or both events of a pair (§4.6)."""
    return "pairs" if name == "cut" else "suppressed"
