"""Seal a frame and open it again: kind, sequence number, payload, CRC, COBS, and a zero byte behind."""

from __future__ import annotations

from binascii import crc_hqx
from enum import IntEnum
from functools import cache
from typing import Any, NamedTuple

from tiegocancel.errors import MissingExtraError

__all__ = ["LONGEST_BYTES", "VERSION", "Frame", "Kind", "open_frame", "seal_content", "seal_frame"]

VERSION = 1
LONGEST_BYTES = 1536
"""No encoded frame is longer; a receiver may drop what is."""


class Kind(IntEnum):
    """What a frame carries; below 8 by either end, from 8 on by the host alone."""

    HELLO = 0
    EVENTS = 1
    DECISIONS = 2
    TEXT = 3
    ASK = 8
    START = 9
    STOP = 10
    CREDIT = 11


class Frame(NamedTuple):
    """A frame whose CRC was right; ``kind`` may be one that this version does not know."""

    kind: int
    sequence: int
    payload: bytes


def seal_frame(kind: Kind, sequence: int, payload: bytes) -> bytes:
    """Return the bytes of a frame as they go over the line."""
    return seal_content(bytes([VERSION << 4 | kind, sequence & 0xFF]) + payload)


def seal_content(content: bytes) -> bytes:
    """Seal ``content``, which begins with the two bytes of kind and sequence number."""
    # CRC-16/IBM-3740, also known as CCITT-FALSE: polynomial 0x1021, start 0xFFFF. The standard library has it.
    encoded: bytes = _cobs().encode(content + crc_hqx(content, 0xFFFF).to_bytes(2, "big"))
    return encoded + b"\0"


def open_frame(encoded: bytes) -> Frame | None:
    """Open the bytes between two zeros; ``None`` where they are no sound frame of this version."""
    if not 5 <= len(encoded) <= LONGEST_BYTES:
        return None
    cobs = _cobs()
    try:
        content = cobs.decode(encoded)
    except cobs.DecodeError:
        return None
    # With its high byte first the CRC over content and CRC is 0.
    if crc_hqx(content, 0xFFFF) or content[0] >> 4 != VERSION or len(content) < 4:
        return None
    return Frame(content[0] & 0xF, content[1], content[2:-2])


@cache
def _cobs() -> Any:
    try:
        from cobs import cobs
    except ImportError:
        raise MissingExtraError("the framed protocol", "cobs", "link") from None
    return cobs
