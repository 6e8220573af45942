"""Set what the two ends of a link must agree on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tiegocancel.errors import ConfigError
from tiegocancel.events import MAX_SIDE_PX

__all__ = ["EDVS_FORMATS", "ProtocolOptions"]

EDVS_FORMATS = ("E0", "E1", "E2", "E3", "E4")


@dataclass(frozen=True, slots=True, kw_only=True)
class ProtocolOptions:
    """Describe the sensor, its axes and its clock; what a protocol does not have, it leaves alone.

    ``width`` and ``height`` in px, 0 for the protocol's own. ``edvs_format`` is the event format that an eDVS is told
    to send. ``swap_xy`` exchanges the axes, then ``flip_x`` and ``flip_y`` mirror them, in what a decoder returns; an
    encoder undoes it. ``off_bit``: a set polarity bit of an eDVS means OFF. A step in time above ``max_jump_us``, or a
    step back, is believed only when what follows confirms it. ``tick_ns`` is one tick of the framed protocol's clock,
    a divisor of 1000, and ``frame_events`` the most events that a frame of it holds: fewer lose less on a bad line.
    ``now_us`` stamps events that bear no time (E0); by default the host's monotonic clock.
    ``sensor_bitmap`` asks an eDVS for its sensors' lines every ``sensor_period_ms`` (128: raw gyroscope, 1024: in °/s).
    """

    width: int = 0
    height: int = 0
    edvs_format: str = "E3"
    swap_xy: bool = False
    flip_x: bool = False
    flip_y: bool = False
    off_bit: bool = True
    max_jump_us: int = 1_000_000
    tick_ns: int = 1000
    frame_events: int = 96
    now_us: Callable[[], int] | None = None
    sensor_bitmap: int = 0
    sensor_period_ms: int = 8

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            side = getattr(self, name)
            if not 0 <= side <= MAX_SIDE_PX:
                raise ConfigError(f"{name} must be from 0 (the protocol's own) to {MAX_SIDE_PX} px, not {side}")
        if self.edvs_format not in EDVS_FORMATS:
            raise ConfigError(f"edvs_format must be one of {', '.join(EDVS_FORMATS)}, not {self.edvs_format!r}")
        if not 1 <= self.frame_events <= 128:
            raise ConfigError(f"frame_events must be from 1 to 128, not {self.frame_events}")
        if not 0 <= self.sensor_bitmap < 1 << 32:
            raise ConfigError(f"sensor_bitmap must be from 0 to {(1 << 32) - 1}, not {self.sensor_bitmap}")
        if self.sensor_period_ms < 1:
            raise ConfigError(f"sensor_period_ms must be at least 1 ms, not {self.sensor_period_ms}")
        if self.max_jump_us < 1:
            raise ConfigError(f"max_jump_us must be at least 1 µs, not {self.max_jump_us}")
        if self.tick_ns < 1 or 1000 % self.tick_ns:
            raise ConfigError(f"tick_ns must divide 1000, so that a µs is a whole number of ticks, not {self.tick_ns}")
