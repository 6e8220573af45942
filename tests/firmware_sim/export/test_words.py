"""Words keep every value that fits, refuse what does not, and are read as ``$readmemh`` reads them."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tiegocancel.firmware_sim.export.words import Field, Word, memh_text, read_memh, signed_bits, unsigned_bits

from tiegocancel.errors import InputError

PAIR = Word((Field(name="t", bits=5), Field(name="v", bits=3, signed=True)))


@given(data=st.data(), shape=st.lists(st.tuples(st.integers(1, 70), st.booleans()), min_size=1, max_size=6))
def test_fields_of_any_width_come_back(data: st.DataObject, shape: list[tuple[int, bool]]) -> None:
    word = Word(tuple(Field(name=str(i), bits=bits, signed=signed) for i, (bits, signed) in enumerate(shape)))
    values = tuple(data.draw(st.integers(field.low, field.high)) for field in word.fields)
    packed = word.pack(values)
    assert word.unpack(packed) == values
    assert len(f"{packed:x}") <= word.digits
    assert Word.from_json(word.to_json()) == word


@given(least=st.integers(-(1 << 62), 1 << 62), more=st.integers(0, 1 << 62))
def test_widths_are_enough_and_not_more(least: int, more: int) -> None:
    most = least + more
    field = Field(name="v", bits=signed_bits(least, most), signed=True)
    assert field.low <= least <= most <= field.high
    narrower = Field(name="v", bits=max(field.bits - 1, 1), signed=True)
    assert field.bits == 1 or least < narrower.low or most > narrower.high
    unsigned = Field(name="u", bits=unsigned_bits(more))
    assert more <= unsigned.high
    assert unsigned.bits == 1 or more > Field(name="u", bits=unsigned.bits - 1).high


@pytest.mark.parametrize(
    ("values", "line"),
    [((32, 0), "t = 32 does not fit 5 bits, unsigned"), ((-1, 0), "t = -1"), ((0, 4), "v = 4 does not fit 3 bits, s")],
)
def test_what_does_not_fit_is_named(values: tuple[int, int], line: str) -> None:
    with pytest.raises(ValueError, match=line):
        PAIR.pack(values)


def test_the_first_field_lies_in_the_highest_bits(tmp_path: Path) -> None:
    text = memh_text("pairs", PAIR, [(1, -1), (31, 3)])
    assert text.splitlines() == [
        "// pairs: 2 words of 8 bits, for $readmemh",
        "// [7:3]     t  unsigned",
        "// [2:0]     v  signed",
        "0f",
        "fb",
    ]
    (tmp_path / "m.memh").write_text(text + "/* more\n 00 */ 0F // last\n")
    assert read_memh(tmp_path / "m.memh", PAIR) == [(1, -1), (31, 3), (1, -1)]


@pytest.mark.parametrize(
    ("data", "line"),
    [
        (b"0f\n0x1\n", "word 1: expected hexadecimal digits, found '0x1'"),
        (b"0f\n1ff\n", "word 1: 1ff does not fit 8 bits"),
        (b"0f\n\xff\n", "byte 3: is not ASCII"),
    ],
)
def test_a_fault_names_its_word(tmp_path: Path, data: bytes, line: str) -> None:
    (tmp_path / "m.memh").write_bytes(data)
    with pytest.raises(InputError, match=line):
        read_memh(tmp_path / "m.memh", PAIR)
