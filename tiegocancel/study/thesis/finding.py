"""Hold one line of the summary, and the words that several of them use."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["MATTERS", "SELECTIVE", "Finding", "against_control", "percent"]

MATTERS = 0.05
"""Shares closer than this say the same."""
SELECTIVE = 0.2
"""From this gap on, a control is far behind."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the summary: the thesis's figure, ours by column (``None`` where there is none), the verdict."""

    where: str
    what: str
    thesis: str
    ours: dict[str, str | None]
    verdict: str


def percent(value: float | None) -> str:
    """Write a share; a dash where there is none."""
    return "–" if value is None else f"{100 * value:.1f} %"


def against_control(true: float, zero: float) -> str:
    """Say what the ratio is worth beside zero motion."""
    gap = true - zero
    if gap < MATTERS:
        return f"zero motion cancels as much ({percent(zero)} against {percent(true)}), so it shows no prediction"
    if gap < SELECTIVE:
        return f"zero motion comes within {100 * gap:.0f} points"
    return f"zero motion stays {100 * gap:.0f} points behind: here the motion is what cancels"
