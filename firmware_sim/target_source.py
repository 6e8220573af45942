"""Where the numbers of a target come from: every table of a target file names its source."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

__all__ = ["UNVERIFIED", "Sourced", "numbers_of", "unverified_of"]

UNVERIFIED = "unverified:"
"""A source that begins so says that no document was found: reports repeat it beside the number."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sourced:
    """Carry the document behind the numbers of one table.

    ``source``: datasheet, section, table, page; it covers every field of the table that ``sources`` does not name.
    ``sources``: pairs of field and document, where one field comes from elsewhere.
    """

    source: str
    sources: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        fields = {field.name for field in dataclasses.fields(self)} - {"source", "sources"}
        for text in (self.source, *(text for _, text in self.sources)):
            if len(text.strip()) < 4:
                raise ValueError(f"source must name a document, not {text!r}")
        for name, _ in self.sources:
            if name not in fields:
                raise ValueError(f"sources names {name!r}, which is no field here; fields: {', '.join(sorted(fields))}")

    def source_of(self, field: str) -> str:
        """Return the document behind one field."""
        return dict(self.sources).get(field, self.source)


def numbers_of(part: object, path: str = "") -> Iterator[tuple[str, int | float, str]]:
    """Yield path, value and source of every number below ``part``; what a file leaves at its default is none.

    A list of tables is walked by the entry's ``name`` or ``grade``: ``memories[DP16KD].bits``. Modes are left whole:
    their table's source covers them.
    """
    for field in dataclasses.fields(part):  # type: ignore[arg-type]
        value = getattr(part, field.name)
        place = f"{path}.{field.name}" if path else field.name
        if isinstance(value, bool) or value == field.default:
            continue
        if isinstance(value, int | float) and isinstance(part, Sourced):
            yield place, value, part.source_of(field.name)
        elif dataclasses.is_dataclass(value):
            yield from numbers_of(value, place)
        elif isinstance(value, tuple):
            for index, item in enumerate(value):
                if dataclasses.is_dataclass(item):
                    yield from numbers_of(item, f"{place}[{getattr(item, 'name', getattr(item, 'grade', index))}]")


def unverified_of(part: object) -> tuple[str, ...]:
    """Return the paths of the numbers below ``part`` for which no document was found."""
    return tuple(path for path, _, source in numbers_of(part) if source.startswith(UNVERIFIED))
