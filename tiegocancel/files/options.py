"""Say how a file is to be read where the file itself does not."""

from __future__ import annotations

from dataclasses import dataclass

from tiegocancel.errors import ConfigError
from tiegocancel.events import MAX_SIDE_PX

__all__ = ["TIME_UNITS", "ReadOptions"]

TIME_UNITS = ("s", "ms", "us", "ns")


@dataclass(frozen=True, kw_only=True, slots=True)
class ReadOptions:
    """Declarations of the user, each ``None`` where the file decides.

    ``width`` and ``height`` in px; ``time_unit`` one of s, ms, us, ns; ``columns`` the order of plain columns, as
    letters t x y p with ``-`` for a column to skip; ``chunk_events`` rows a chunk; ``keep_going`` keeps what was
    decoded before a fault; ``undistort`` the file of a calibration whose lens is undone. Raise :class:`ConfigError` for
    a value that cannot be meant.
    """

    width: int | None = None
    height: int | None = None
    time_unit: str | None = None
    columns: str | None = None
    chunk_events: int = 1 << 20
    keep_going: bool = False
    undistort: str | None = None

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            side = getattr(self, name)
            if side is not None and not 1 <= side <= MAX_SIDE_PX:
                raise ConfigError(f"{name} must be from 1 to {MAX_SIDE_PX} px, not {side}")
        if self.time_unit is not None and self.time_unit not in TIME_UNITS:
            raise ConfigError(f"time unit must be one of {', '.join(TIME_UNITS)}, not {self.time_unit!r}")
        if self.columns is not None and sorted(self.columns.replace("-", "")) != sorted("txyp"):
            raise ConfigError(
                f"columns must name t, x, y and p once each, and - for a column to skip, not {self.columns!r}"
            )
        if self.chunk_events < 1:
            raise ConfigError(f"chunk size must be at least 1 event, not {self.chunk_events}")
