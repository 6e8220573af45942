"""Lay fields side by side in one word, and write words as Verilog's ``$readmemh`` reads them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tiegocancel.errors import InputError
from tiegocancel.files.short import short

__all__ = ["Field", "Word", "memh_text", "read_memh", "signed_bits", "unsigned_bits"]

_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_DIGITS = re.compile(r"[0-9a-fA-F]+", re.ASCII)


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """One field of a word: ``bits`` wide, in two's complement where ``signed``; ``text`` says what it holds."""

    name: str
    bits: int
    signed: bool = False
    text: str = ""

    def __post_init__(self) -> None:
        if self.bits < 1:
            raise ValueError(f"{self.name} must be at least 1 bit wide, not {self.bits}")

    @property
    def low(self) -> int:
        """The least value that fits."""
        return -(1 << (self.bits - 1)) if self.signed else 0

    @property
    def high(self) -> int:
        """The largest value that fits."""
        return (1 << (self.bits - self.signed)) - 1


@dataclass(frozen=True, slots=True)
class Word:
    """Several fields in one word, the first in the highest bits, the last from bit 0 on."""

    fields: tuple[Field, ...]

    @property
    def bits(self) -> int:
        """Width of the word."""
        return sum(field.bits for field in self.fields)

    @property
    def digits(self) -> int:
        """Hexadecimal digits that the word needs."""
        return -(-self.bits // 4)

    def placed(self) -> Iterator[tuple[Field, int]]:
        """Yield each field with its lowest bit, from the highest field down."""
        at = self.bits
        for field in self.fields:
            at -= field.bits
            yield field, at

    def pack(self, values: Sequence[int]) -> int:
        """Return the word of one value a field; raise ``ValueError`` naming the field that a value does not fit."""
        word = 0
        for field, value in zip(self.fields, values, strict=True):
            if not field.low <= value <= field.high:
                kind = "signed" if field.signed else "unsigned"
                raise ValueError(f"{field.name} = {value} does not fit {field.bits} bits, {kind}")
            word = word << field.bits | value & ((1 << field.bits) - 1)
        return word

    def unpack(self, word: int) -> tuple[int, ...]:
        """Return the values of a word; raise ``ValueError`` for one that is too wide."""
        if not 0 <= word < 1 << self.bits:
            raise ValueError(f"{word:x} does not fit {self.bits} bits")
        values = []
        for field, at in self.placed():
            value = word >> at & ((1 << field.bits) - 1)
            values.append(value - (1 << field.bits) if field.signed and value > field.high else value)
        return tuple(values)

    def lines(self) -> list[str]:
        """Say the layout, a line a field."""
        width = max(len(field.name) for field in self.fields)
        return [
            f"[{at + field.bits - 1}:{at}]".ljust(9)
            + f" {field.name.ljust(width)}  {'signed' if field.signed else 'unsigned'}"
            + (f", {field.text}" if field.text else "")
            for field, at in self.placed()
        ]

    def to_json(self) -> dict[str, Any]:
        """Return the layout as JSON holds it."""
        return {
            "bits": self.bits,
            "fields": [
                {"name": field.name, "lsb": at, "bits": field.bits, "signed": field.signed, "text": field.text}
                for field, at in self.placed()
            ],
        }

    @classmethod
    def from_json(cls, table: dict[str, Any]) -> Word:
        """Return the layout that :meth:`to_json` gave; raise ``ValueError`` where its fields leave gaps."""
        word = cls(
            tuple(
                Field(name=one["name"], bits=one["bits"], signed=one["signed"], text=one["text"])
                for one in table["fields"]
            )
        )
        if [one["lsb"] for one in table["fields"]] != [at for _, at in word.placed()] or table["bits"] != word.bits:
            raise ValueError("the fields of a word must lie side by side, the first in the highest bits")
        return word


def unsigned_bits(most: int) -> int:
    """Return the width that holds 0 to ``most``, at least 1."""
    return max(most.bit_length(), 1)


def signed_bits(least: int, most: int) -> int:
    """Return the width in two's complement that holds ``least`` to ``most``."""
    return max((value if value >= 0 else ~value).bit_length() + 1 for value in (least, most))


def memh_text(title: str, word: Word, rows: Iterable[Sequence[int]]) -> str:
    """Return the text of a memory image: the layout in comments, then a word a line. ASCII."""
    words = [f"{word.pack(row):0{word.digits}x}" for row in rows]
    head = [f"{title}: {len(words)} words of {word.bits} bits, for $readmemh", *word.lines()]
    return "".join(f"{line}\n" for line in (*(f"// {line}" for line in head), *words))


def read_memh(path: Path, word: Word) -> list[tuple[int, ...]]:
    """Return the rows of a memory image; raise ``InputError`` naming the word that cannot be read."""
    try:
        text = path.read_bytes().decode("ascii")
    except OSError as error:
        raise InputError(path, "", f"cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(path, f"byte {error.start}", "is not ASCII; expected a memory image") from None
    rows = []
    for number, token in enumerate(_COMMENT.sub(" ", text).split()):
        if _DIGITS.fullmatch(token) is None:
            raise InputError(path, f"word {number}", f"expected hexadecimal digits, found {short(repr(token))}")
        try:
            rows.append(word.unpack(int(token, 16)))
        except ValueError as error:
            raise InputError(path, f"word {number}", str(error)) from None
    return rows
