"""Lay out the events of an eDVS: 1yyyyyyy pxxxxxxx, then a time stamp, most significant byte first, in µs.

Sources: iniVation's eDVS guide (15 Aug 2019), libcaer src/edvs.c, the firmware's own list of formats.
"""

from __future__ import annotations

__all__ = ["SIDE_PX", "event_bytes", "stamp_bytes"]

SIDE_PX = 128

_STAMP_BYTES = {"E0": 0, "E2": 2, "E3": 3, "E4": 4}


def stamp_bytes(edvs_format: str) -> int:
    """Return how many bytes of time end each event; E1, whose deltas vary, has no number (``KeyError``)."""
    return _STAMP_BYTES[edvs_format]


def event_bytes(edvs_format: str) -> int:
    """Return the bytes of an event of a format of fixed size."""
    return 2 + stamp_bytes(edvs_format)
