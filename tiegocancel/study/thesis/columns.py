"""Name the columns of the summary."""

from __future__ import annotations

__all__ = ["COLUMNS", "counted"]

COLUMNS = {
    "printed": "as printed",
    "printed_off": "own off",
    "cut": "(4.4), pairs",
    "gated": "(4.4), own off, no warm-up",
    "zero": "control: zero motion",
    "reversed": "control: reversed",
    "stream": "streaming",
}
"""Series of the summary's columns: the first three on windows that were cut out, as the thesis did; in the rest what
comes before a window leads into it, and where nothing does, the warm-up is not counted."""


def counted(name: str) -> str:
    """Return what a column counts: events that were suppressed, or both events of a pair (§4.6)."""
    return "pairs" if name == "cut" else "suppressed"
