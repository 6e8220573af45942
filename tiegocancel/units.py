"""Write quantities for people."""

from __future__ import annotations

__all__ = ["rate_text"]


def rate_text(rate_hz: float) -> str:
    """Return an event rate with three digits that count: ``3.74 Mev/s``, ``12.3 kev/s``, ``92 ev/s``."""
    for factor, unit in ((1e6, "Mev/s"), (1e3, "kev/s")):
        if rate_hz >= 0.9995 * factor:
            return f"{rate_hz / factor:.3g} {unit}"
    return f"{rate_hz:.3g} ev/s"
