"""Hold a stream of events as frozen, contiguous columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["EGO", "EVENT_DTYPE", "MAX_SIDE_PX", "MAX_TIME_US", "MOVER", "NOISE", "Events"]

EVENT_DTYPE = np.dtype([("t", "<u8"), ("x", "<u2"), ("y", "<u2"), ("on", "?")])
"""The structured dtype that event tools exchange: time in µs, column, row, polarity."""

EGO, MOVER, NOISE = 0, 1, 2
"""Labels of what caused an event: ego-motion, an independent mover, sensor noise."""

MAX_SIDE_PX = 65_536
MAX_TIME_US = 1 << 60


@dataclass(frozen=True, slots=True, eq=False)
class Events:
    """Events in the order of their times, as read-only columns of equal length ``n``.

    ``t`` int64[n] in µs, never decreasing, ``|t| ≤ 2^60``; ``x`` uint16[n] in ``[0, width)`` px; ``y`` uint16[n]
    in ``[0, height)`` px; ``p`` uint8[n], 1 = ON, 0 = OFF; ``label`` int8[n] or ``None`` (0 = ego, 1 = mover,
    2 = noise), for scoring only. Raise ``ValueError`` naming the column, row and value when a check fails.
    """

    t: NDArray[np.int64]
    x: NDArray[np.uint16]
    y: NDArray[np.uint16]
    p: NDArray[np.uint8]
    width: int
    height: int
    label: NDArray[np.int8] | None = None

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            side = getattr(self, name)
            if isinstance(side, bool) or int(side) != side or not 1 <= side <= MAX_SIDE_PX:
                raise ValueError(f"{name} must be an integer from 1 to {MAX_SIDE_PX} px, not {side!r}")
            object.__setattr__(self, name, int(side))
        bounds: dict[str, tuple[type, int, int]] = {
            "t": (np.int64, -MAX_TIME_US, MAX_TIME_US),
            "x": (np.uint16, 0, self.width - 1),
            "y": (np.uint16, 0, self.height - 1),
            "p": (np.uint8, 0, 1),
            "label": (np.int8, EGO, NOISE),
        }
        for name, (dtype, low, high) in bounds.items():
            column = getattr(self, name)
            if name == "label" and column is None:
                continue
            object.__setattr__(self, name, _column(name, column, dtype, low, high))
        lengths = {name: len(getattr(self, name)) for name in bounds if getattr(self, name) is not None}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"columns must have one length, not {lengths}")
        if len(self.t) > 1:
            steps = self.t[1:] < self.t[:-1]
            if steps.any():
                row = int(np.argmax(steps)) + 1
                raise ValueError(
                    f"t must not decrease: row {row} has {self.t[row]} µs after {self.t[row - 1]} µs; "
                    "Events.from_unsorted sorts"
                )

    @classmethod
    def empty(cls, width: int, height: int, *, labelled: bool = False) -> Events:
        """Return a stream without events."""
        none: list[int] = []
        return cls(none, none, none, none, width, height, none if labelled else None)  # type: ignore[arg-type]

    @classmethod
    def from_unsorted(
        cls,
        t: ArrayLike,
        x: ArrayLike,
        y: ArrayLike,
        p: ArrayLike,
        width: int,
        height: int,
        label: ArrayLike | None = None,
    ) -> tuple[Events, int]:
        """Sort columns stably by time; return the events and how many had to move back in time.

        The count is the number of rows whose time is below the largest time before them (0: nothing changed).
        """
        times = np.asarray(t)
        late = int(np.count_nonzero(times < np.maximum.accumulate(times))) if len(times) else 0
        columns: list[Any] = [t, x, y, p, label]
        if late:
            order = np.argsort(times, kind="stable")
            columns = [None if c is None else np.asarray(c)[order] for c in columns]
        return cls(columns[0], columns[1], columns[2], columns[3], width, height, columns[4]), late

    @classmethod
    def from_structured(cls, rows: NDArray[Any], width: int, height: int) -> Events:
        """Read the structured dtype :data:`EVENT_DTYPE` (``on`` may also be called ``p``)."""
        names = rows.dtype.names or ()
        polarity = "on" if "on" in names else "p"
        missing = [name for name in ("t", "x", "y", polarity) if name not in names]
        if missing:
            raise ValueError(f"structured events need the fields t, x, y and on, not {names}")
        return cls(rows["t"], rows["x"], rows["y"], rows[polarity], width, height)

    def to_structured(self) -> NDArray[Any]:
        """Return the events as :data:`EVENT_DTYPE`; times below 0 µs raise ``ValueError`` (the field is unsigned)."""
        if len(self) and self.t[0] < 0:
            raise ValueError(f"structured events hold no times below 0 µs, and the first is {self.t[0]} µs")
        rows = np.empty(len(self), EVENT_DTYPE)
        rows["t"], rows["x"], rows["y"], rows["on"] = self.t, self.x, self.y, self.p
        return rows

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, rows: slice) -> Events:
        """Slice by index without copying; a step other than 1 copies, a negative one is refused."""
        if not isinstance(rows, slice):
            raise TypeError(f"Events takes a slice, not {type(rows).__name__}; use Events.select for a mask")
        if rows.step is not None and rows.step < 1:
            raise ValueError(f"the step of a slice must be positive, or time would run backwards, not {rows.step}")
        return self._take(rows)

    def select(self, mask: NDArray[np.bool_]) -> Events:
        """Return the events where ``mask`` bool[n] is true, in order."""
        if mask.dtype != np.bool_ or mask.shape != (len(self),):
            raise ValueError(f"mask must be bool[{len(self)}], not {mask.dtype}{list(mask.shape)}")
        return self._take(mask)

    def between(self, start_us: int, stop_us: int) -> Events:
        """Return the events with ``start_us ≤ t < stop_us``, without copying."""
        first, last = np.searchsorted(self.t, [start_us, stop_us], side="left")
        return self[int(first) : int(last)]

    @property
    def span_us(self) -> int:
        """Time from the first to the last event in µs, 0 for fewer than two."""
        return int(self.t[-1] - self.t[0]) if len(self) else 0

    def _take(self, rows: slice | NDArray[np.bool_]) -> Events:
        """Build from columns that were validated before: any subset in order is valid too."""
        part = object.__new__(Events)
        for name in ("t", "x", "y", "p", "label"):
            column: NDArray[Any] | None = getattr(self, name)
            if column is not None:
                column = np.ascontiguousarray(column[rows])
                column.flags.writeable = False
            object.__setattr__(part, name, column)
        object.__setattr__(part, "width", self.width)
        object.__setattr__(part, "height", self.height)
        return part

    @staticmethod
    def concatenate(parts: list[Events]) -> Events:
        """Join consecutive chunks of one stream; time must not decrease across them.

        Sensor sizes must agree, and either all chunks with events carry labels or none does.
        """
        if not parts:
            raise ValueError("concatenate needs at least one chunk")
        sizes = {(part.width, part.height) for part in parts}
        if len(sizes) > 1:
            raise ValueError(f"chunks must come from one sensor size, not {sorted(sizes)}")
        width, height = sizes.pop()
        parts = [part for part in parts if len(part)] or parts[:1]
        labelled = parts[0].label is not None
        if any((part.label is not None) != labelled for part in parts):
            raise ValueError("either all chunks carry labels or none does")
        return Events(
            np.concatenate([part.t for part in parts]),
            np.concatenate([part.x for part in parts]),
            np.concatenate([part.y for part in parts]),
            np.concatenate([part.p for part in parts]),
            width,
            height,
            np.concatenate([part.label for part in parts if part.label is not None]) if labelled else None,
        )


def _column(name: str, values: ArrayLike, dtype: type, low: int, high: int) -> NDArray[Any]:
    """Check the range of one column in its own dtype, then cast it to ``dtype``, contiguous and read-only."""
    given = np.asarray(values)
    if given.ndim != 1:
        raise ValueError(f"{name} must be one-dimensional, not of shape {given.shape}")
    if given.size == 0:
        given = given.astype(dtype)
    if given.dtype.kind not in "biu":
        raise ValueError(f"{name} must be integers, not {given.dtype}")
    wrong = np.zeros(0, np.bool_)
    if given.size and (int(given.min()) < low or int(given.max()) > high):
        wrong = (given < low) | (given > high) if given.dtype.kind == "i" else given > high
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ValueError(f"{name} must be from {low} to {high}: row {row} has {given[row]}")
    # A copy, so that nobody can change what was checked: the kernels trust it without looking.
    column: NDArray[Any] = np.array(given, dtype=dtype, order="C")
    column.flags.writeable = False
    return column
