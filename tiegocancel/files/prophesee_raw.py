"""Open Prophesee RAW files: what their encodings share."""

from __future__ import annotations

from typing import ClassVar

from tiegocancel.files.prophesee_header import read_prophesee_header
from tiegocancel.files.reader import EventReader

__all__ = ["PropheseeRawReader"]


class PropheseeRawReader(EventReader):
    """Read the text header; ``_offset`` is the byte behind it. ``encoding`` names the encoding to a user."""

    encoding: ClassVar[str]

    def _open(self) -> None:
        header = read_prophesee_header(self.path)
        if header.encoding not in (self.format, ""):
            raise self.fail("header", f"says encoding {header.encoding[:20]!r}, expected {self.encoding}")
        self._offset = header.data_offset
        self._size_of_file = header.size
        if header.size is not None and "plug-in" in header.size_source:
            self.note(f"sensor size {header.size[0]}x{header.size[1]} from the {header.size_source}")
