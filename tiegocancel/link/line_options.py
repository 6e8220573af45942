"""Set how a line is opened and how long its silences may last."""

from __future__ import annotations

from dataclasses import dataclass

from tiegocancel.errors import ConfigError

__all__ = ["BITS_PER_BYTE", "LineOptions"]

BITS_PER_BYTE = 10
"""8N1: a start bit, eight bits of data, a stop bit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LineOptions:
    """Describe one end of a line; what a kind of line does not have, it leaves alone.

    ``baud`` in bits/s; ``rtscts``: hardware flow control; ``exclusive``: refuse a port that another program has locked,
    and lock it. ``write_timeout_s``: a device that takes no byte for so long is a fault. ``reconnect_s``: after a fault
    the line is opened anew, with waits that double from 50 ms to 1 s, for so long at most; 0 never. ``silence_s``: a
    line without a byte for so long ends the stream; 0 never.
    """

    baud: int = 4_000_000
    rtscts: bool = False
    exclusive: bool = True
    write_timeout_s: float = 5.0
    reconnect_s: float = 10.0
    silence_s: float = 30.0

    def __post_init__(self) -> None:
        if not 50 <= self.baud <= 1_000_000_000:
            raise ConfigError(f"baud must be from 50 to 10^9 bits/s, not {self.baud}")
        if not 0.0 < self.write_timeout_s <= 3600.0:
            raise ConfigError(f"write_timeout_s must be above 0 and at most 3600 s, not {self.write_timeout_s}")
        for name in ("reconnect_s", "silence_s"):
            if not 0.0 <= getattr(self, name) <= 86_400.0:
                raise ConfigError(f"{name} must be from 0 (never) to 86400 s, not {getattr(self, name)}")

    @property
    def bytes_per_s(self) -> float:
        """What the line carries at this baud."""
        return self.baud / BITS_PER_BYTE
