"""Read HDF5 recordings through eventcv."""

from __future__ import annotations

from typing import ClassVar

from tiegocancel.files.eventcv_bridge import EventcvReader

__all__ = ["Hdf5Reader"]


class Hdf5Reader(EventcvReader):
    """Decode HDF5 columns, found by their names; the unit of time must be declared, because eventcv would guess it."""

    format: ClassVar[str] = "hdf5"
    suffix: ClassVar[str] = ".h5"

    def _prepare(self) -> None:
        unit = self.options.time_unit
        if unit is None:
            raise self.fail("", "times in HDF5 have no unit: declare it with --time-unit s, ms, us or ns")
        self.time_unit = unit
        self.note(f"time unit: {unit}, as declared")
        self._arguments = {"time_unit": self.eventcv_unit[unit]}
        if self.options.width and self.options.height:
            self._arguments["sensor_size"] = (self.options.width, self.options.height)
        else:
            self.note("sensor size as eventcv finds it: in the file, or from the largest coordinate")
