"""EVT 2.0: header, time wraps, words without events, faults at their byte, other tools as witnesses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import Events, InputError, open_events, read_events, write_events
from tiegocancel.files import evt2

Save = Callable[..., Path]
HEADER = b"% evt 2.0\n% format EVT2;height=48;width=64\n% geometry 64x48\n% end\n"


def high(value: int) -> int:
    return (0x8 << 28) | value


def cd(t: int, x: int, y: int, on: int) -> int:
    return (on << 28) | ((t & 63) << 22) | (x << 11) | y


def raw(*words: int) -> bytes:
    return np.array(words, "<u4").tobytes()


def test_words_become_events(saved: Save) -> None:
    words = raw(cd(1, 9, 9, 1), high(2), cd(5, 63, 47, 1), high(2), 0xA0000101, cd(6, 0, 1, 0), 0xE0000000, 0xF0000000)
    with open_events(saved("a.raw", HEADER + words)) as reader:
        e = reader.read()
    assert (e.width, e.height) == (64, 48)
    assert (e.t.tolist(), e.x.tolist(), e.y.tolist(), e.p.tolist()) == ([133, 134], [63, 0], [47, 1], [1, 0])
    assert "1 events before the first time word left out" in reader.notes


def test_time_wraps_are_followed_and_small_steps_back_are_not(saved: Save) -> None:
    top = (1 << 28) - 1
    words = raw(high(top), cd(63, 1, 1, 1), high(0), cd(0, 2, 2, 1), high(top), cd(0, 3, 3, 1), high(1), cd(0, 4, 4, 0))
    events = read_events(saved("a.raw", HEADER + words))
    end = 1 << 34
    assert events.t.tolist() == [end - 1, end, 2 * end - 64, 2 * end + 64]
    back = raw(high(9), cd(0, 1, 1, 1), high(8), cd(0, 2, 2, 1))
    assert read_events(saved("b.raw", HEADER + back)).t.tolist() == [512, 576]


@pytest.mark.parametrize("block_words", [1, 3, 64])
def test_blocks_of_any_size_give_the_same_events(
    block_words: int,
    tmp_path: Path,
    stream: Callable[..., Events],
    same: Callable[..., bool],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    events = stream(n=300)
    write_events(tmp_path / "a.raw", events)
    monkeypatch.setattr(evt2, "_BLOCK_WORDS", block_words)
    assert same(read_events(tmp_path / "a.raw"), events)


@pytest.mark.parametrize(
    ("tail", "where", "problem"),
    [
        (raw(0x50000000, cd(0, 1, 1, 1)), len(HEADER) + 8, "word type 0x5"),
        (b"\x01\x02\x03", len(HEADER) + 8, "3 bytes of a 4-byte word"),
        (raw(cd(0, 64, 1, 1)), len(HEADER) + 8, "x is 64"),
        (raw(high(1), cd(0, 1, 48, 1)), len(HEADER) + 12, "y is 48"),
    ],
)
def test_a_fault_is_named_by_its_byte_after_the_events_before_it(
    tail: bytes, where: int, problem: str, saved: Save
) -> None:
    path = saved("a.raw", HEADER + raw(high(1), cd(0, 1, 1, 1)) + tail)
    chunks: list[Events] = []
    with open_events(path) as reader, pytest.raises(InputError) as caught:
        chunks.extend(reader)
    assert caught.value.where == f"byte {where}"
    assert problem in caught.value.problem
    assert [len(chunk) for chunk in chunks] == [1]
    with open_events(path, keep_going=True) as reader:
        assert len(reader.read()) == 1
    assert reader.faults == 1
    assert any(f"byte {where}" in note and "kept 1 events" in note for note in reader.notes)


@pytest.mark.parametrize(
    ("lines", "size"),
    [
        (b"% evt 2.0\n% plugin_name hal_plugin_gen31_fx3\n", (640, 480)),
        (b"% evt 2.0\n% plugin_name hal_plugin_gen41_evk3\n", (1280, 720)),
        (b"% format EVT2;height=320;width=320\n% end\n", (320, 320)),
        (b"% evt 2.0\n% geometry 304x240\n", (304, 240)),
        (b"% evt 2.0\n% plugin_name hal_plugin_gen9\n", (41, 31)),
    ],
)
def test_the_sensor_size_comes_from_the_header_or_the_events(lines: bytes, size: tuple[int, int], saved: Save) -> None:
    with open_events(saved("a.raw", lines + raw(high(1), cd(0, 40, 30, 1)))) as reader:
        assert (reader.width, reader.height) == size


def test_data_that_begin_with_the_byte_of_a_header_line_are_data(saved: Save) -> None:
    words = raw(high(0x25), cd(0, 1, 1, 1))
    assert words[:1] == b"%"
    for header in (b"% evt 2.0\n% geometry 64x48\n", HEADER):
        assert read_events(saved("a.raw", header + words)).t.tolist() == [0x25 << 6]


def test_evt21_is_refused_by_name(saved: Save) -> None:
    for line in (b"% evt 2.1\n", b"% format EVT21;height=720;width=1280\n"):
        with pytest.raises(InputError, match=r"EVT21 is not read: .*EVT 2\.0 or 3\.0"):
            open_events(saved("a.raw", line + b"% end\n" + b"\0" * 16))


def test_other_tools_read_what_is_written(tmp_path: Path, stream: Callable[..., Events]) -> None:
    faery, expelliarmus = pytest.importorskip("faery"), pytest.importorskip("expelliarmus")
    eventcv = pytest.importorskip("eventcv")
    events = stream(n=5000, step_us=300)
    path = tmp_path / "a.raw"
    write_events(path, events)
    rows = faery.events_stream_from_file(path).to_array()
    for name, theirs in zip("txyp", ("t", "x", "y", "on"), strict=True):
        assert np.array_equal(rows[theirs], getattr(events, name))
    rows = expelliarmus.Wizard(encoding="evt2").read(path)
    for name in "txyp":
        assert np.array_equal(rows[name], getattr(events, name))
    recording = eventcv.open(str(path), time_unit="us", sensor_size=(64, 48))
    rows = recording.slice_count(0, recording.n_events).numpy()
    assert np.array_equal(rows, np.stack([events.x, events.y, events.t, events.p], axis=1))


def test_a_file_of_another_tool_is_read(
    tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    expelliarmus = pytest.importorskip("expelliarmus")
    events = stream(n=5000, step_us=300)
    rows = np.zeros(len(events), np.dtype([("t", "<i8"), ("x", "<i2"), ("y", "<i2"), ("p", "u1")], align=True))
    for name in "txyp":
        rows[name] = getattr(events, name)
    expelliarmus.Wizard(encoding="evt2").save(fpath=tmp_path / "a.raw", arr=rows)
    assert same(read_events(tmp_path / "a.raw", format="evt2"), events)


@pytest.mark.parametrize(
    "line", [b"% geometry 48x", b"% format EVT2;height=48;width=", b"% evt 2.0\n% Height 48\n% Width "]
)
@pytest.mark.parametrize("digits", [7, 30, 4000])
def test_a_size_beyond_all_bounds_is_a_short_line(line: bytes, digits: int, saved: Save) -> None:
    path = saved("a.raw", line + b"7" * digits + b"\n% end\n" + raw(high(1), cd(0, 1, 1, 1)))
    with pytest.raises(InputError, match=r"header: .*7777777.*expected.*px") as caught:
        open_events(path, format="evt2")
    assert len(caught.value.problem) < 150


def test_the_header_of_another_encoding_is_refused(saved: Save) -> None:
    with pytest.raises(InputError, match=r"says encoding 'evt2', expected EVT 3\.0"):
        open_events(saved("a.raw", HEADER), format="evt3")
    with pytest.raises(InputError, match=r"says encoding 'evt3', expected EVT 2\.0"):
        open_events(saved("a.raw", HEADER.replace(b"EVT2", b"EVT3")), format="evt2")
