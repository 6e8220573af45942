"""Print what a file says in one short piece, however absurd it is."""

from __future__ import annotations

__all__ = ["short"]


def short(value: object) -> str:
    """Return ``value`` as text on one line of at most 80 characters."""
    text = " ".join(str(value).split())
    return text if len(text) <= 80 else text[:77] + "..."
