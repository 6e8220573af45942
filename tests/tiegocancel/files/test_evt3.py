"""EVT 3.0: the block decoder computes what a plain word-by-word decoder does, at any block size."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel import Events, InputError, open_events, read_events
from tiegocancel.files import evt3

Save = Callable[..., Path]
HEADER = b"% evt 3.0\n% format EVT3;height=2048;width=65536\n% end\n"
KINDS = [0x0, 0x2, 0x3, 0x4, 0x5, 0x6, 0x7, 0x8, 0xA, 0xD, 0xE, 0xF]


def plainly(words: list[int]) -> list[tuple[int, int, int, int]]:
    """Decode word by word, as the format's description tells it."""
    events: list[tuple[int, int, int, int]] = []
    time_us = y = column = -1
    high = loops = polarity = 0
    for word in words:
        kind, value = word >> 12, word & 0xFFF
        if kind == 0x0:
            y = value & 0x7FF
        elif kind == 0x3:
            column, polarity = value & 0x7FF, value >> 11
        elif kind == 0x8:
            loops += high - value >= 4095 - 10
            high = value
            time_us = (loops << 24) | (high << 12)
        elif kind == 0x6 and time_us >= 0:
            time_us = (loops << 24) | (high << 12) | value
        elif kind == 0x2 and min(time_us, y) >= 0:
            events.append((time_us, value & 0x7FF, y, value >> 11))
        elif kind in (0x4, 0x5) and column >= 0:
            bits = 12 if kind == 0x4 else 8
            if min(time_us, y) >= 0:
                events += [(time_us, column + bit, y, polarity) for bit in range(bits) if value >> bit & 1]
            column += bits
    return events


words = st.lists(
    st.builds(lambda kind, value: kind << 12 | value, st.sampled_from(KINDS), st.integers(0, 4095)),
    min_size=1,
    max_size=80,
)
dense = st.lists(
    st.one_of(
        st.builds(lambda v: 0x8000 | v, st.sampled_from([0, 1, 2, 4090, 4095])),
        st.builds(lambda kind, v: kind << 12 | v, st.sampled_from([0, 2, 3, 4, 5, 6]), st.integers(0, 4095)),
    ),
    min_size=1,
    max_size=80,
)


@given(stream_words=words | dense, block_words=st.sampled_from([1, 2, 7, 1 << 17]))
@settings(max_examples=300)
def test_blocks_of_any_size_give_the_events_of_the_plain_decoder(stream_words: list[int], block_words: int) -> None:
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(evt3, "_BLOCK_WORDS", block_words)
        path = Path(folder) / "a.raw"
        path.write_bytes(HEADER + np.array(stream_words, "<u2").tobytes())
        events = read_events(path)
    rows = np.stack([events.t, events.x, events.y, events.p], axis=1).astype(np.int64).tolist()
    assert rows == [list(row) for row in sorted(plainly(stream_words), key=lambda row: row[0])]


def test_events_before_time_and_row_are_left_out_and_counted(saved: Save) -> None:
    stream_words = [0x0005, 0x2001, 0x8001, 0x2002, 0x4003, 0x3004, 0x4003]
    with open_events(saved("a.raw", HEADER + np.array(stream_words, "<u2").tobytes())) as reader:
        assert reader.read().x.tolist() == [2, 4, 5]
    assert "3 events left out that came before the first time, row or base word" in reader.notes


@pytest.mark.parametrize(
    ("tail", "where", "problem"),
    [
        ([0x1000, 0x2003], 6, "word type 0x1"),
        ([0x2003, 0xB000], 8, "word type 0xb"),
        ([0x2030], 6, "x is 48"),
        ([0x302F, 0x4001, 0x4001], 10, "x is 59"),
    ],
)
def test_a_fault_is_named_by_its_byte_after_the_events_before_it(
    tail: list[int], where: int, problem: str, saved: Save
) -> None:
    header = b"% evt 3.0\n% geometry 48x48\n% end\n"
    path = saved("a.raw", header + np.array([0x8001, 0x0003, 0x2001, *tail], "<u2").tobytes())
    seen: list[Events] = []
    with open_events(path) as reader, pytest.raises(InputError) as caught:
        seen.extend(reader)
    assert caught.value.where == f"byte {len(header) + where}"
    assert problem in caught.value.problem
    assert seen[0].x[0] == 1


def test_a_partial_word_at_the_end_is_a_fault(saved: Save) -> None:
    content = HEADER + np.array([0x8001, 0x0003, 0x2001], "<u2").tobytes()
    with pytest.raises(InputError, match=f"byte {len(content)}: ends after 1 bytes of a 2-byte word"):
        read_events(saved("a.raw", content + b"\x00"))


def test_another_decoder_agrees_on_random_words(tmp_path: Path) -> None:
    oracle = pytest.importorskip("evt3")
    rng = np.random.default_rng(5)
    stream_words = [0x8000, 0x0000]
    for time_low in range(0, 4096, 3):
        stream_words.append(0x6000 | time_low)
        for _ in range(int(rng.integers(1, 5))):
            stream_words.append(int(rng.integers(0, 700)))
            stream_words.append(0x2000 | int(rng.integers(0, 2)) << 11 | int(rng.integers(0, 1200)))
            stream_words += [
                0x3000 | int(rng.integers(0, 2)) << 11 | int(rng.integers(0, 1200)),
                0x4000 | int(rng.integers(0, 4096)),
            ]
            stream_words.append(0x5000 | int(rng.integers(0, 256)))
    path = tmp_path / "a.raw"
    path.write_bytes(
        b"% evt 3.0\n% format EVT3;height=720;width=1280\n% end\n" + np.array(stream_words, "<u2").tobytes()
    )
    events, theirs = read_events(path), oracle.decode_file(str(path))
    assert len(events) == len(theirs.t)
    for name in "txyp":
        assert np.array_equal(
            getattr(events, name).astype(np.int64), np.asarray(getattr(theirs, name)).astype(np.int64)
        )
