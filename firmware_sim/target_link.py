"""A link of a device: how many bytes a second its peripheral can carry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tiegocancel.firmware_sim.target_source import Sourced

__all__ = ["Link", "LinkKind"]

LinkKind = Literal["uart", "usb-fs", "usb-hs", "spi", "camera", "pio", "other"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Link(Sourced):
    """One kind of link peripheral.

    ``count``: how many the part has. ``bits_per_second``: the greatest rate on the wire. ``bytes_per_second``: the
    greatest payload that the peripheral carries, framing of the link itself taken off (start and stop bits, packets).
    ``input``, ``output``: whether events can come in or leave here (a camera port only takes in).
    """

    name: str
    kind: LinkKind
    count: int
    bits_per_second: int
    bytes_per_second: int
    input: bool = True
    output: bool = True

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        for name in ("count", "bits_per_second", "bytes_per_second"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive, not {getattr(self, name)}")
        if self.bytes_per_second * 8 > self.bits_per_second:
            raise ValueError(
                f"bytes_per_second must be at most an eighth of bits_per_second = {self.bits_per_second}, "
                f"not {self.bytes_per_second}"
            )
        if not (self.input or self.output):
            raise ValueError("a link must be an input, an output or both")
