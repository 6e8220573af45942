"""Random bytes, truncations and flipped bits: events that pass the checks, or one clear line; never anything else."""

from __future__ import annotations

import io
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel import ConfigError, Events, InputError, open_events, write_events

HEADERS = [
    b"",
    b"\x93NUMPY\x01\x00v\x00{'descr': '<f8', 'fortran_order': False, 'shape': (2, 4), }".ljust(127) + b"\n",
    b"PK\x03\x04\x14\x00\x00\x00\x00\x00",
    b"% evt 2.0\n% geometry 64x48\n% end\n",
    b"% evt 3.0\n% end\n",
    b"% Data file containing CD events\n% Version 2\n\x0c\x08",
    b"#!AER-DAT2.0\r\n",
    b"#!AER-DAT2.0\r\n# AEChip: DAVIS240C\r\n",
    b"x,y,p,t_us\n",
    b"t x y p\n",
]


def survives(content: bytes, name: str, **options: Any) -> int:
    """Read in both modes; return how many events were kept."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(content)
        kept = []
        for keep_going in (False, True):
            count, complaint = 0, f"{path}"
            try:
                with open_events(path, keep_going=keep_going, chunk_events=50, time_unit="us", **options) as reader:
                    last = None
                    for chunk in reader:
                        assert isinstance(chunk, Events)
                        assert last is None or chunk.t[0] >= last
                        last = chunk.t[-1]
                        count += len(chunk)
            except (InputError, ConfigError) as error:
                complaint = str(error)
            assert str(path) in complaint
            assert "\n" not in complaint
            assert len(complaint) < 1000
            kept.append(count)
    assert kept[0] == kept[1]
    return kept[1]


@given(
    header=st.sampled_from(HEADERS), tail=st.binary(max_size=300), suffix=st.sampled_from(["a.npz", "a.raw", "a.csv"])
)
@settings(max_examples=400)
def test_random_bytes(header: bytes, tail: bytes, suffix: str) -> None:
    survives(header + tail, suffix)


@given(text=st.text("0123456789.,;-+ \t\r\n#%eExytp_us", max_size=200))
@settings(max_examples=300)
def test_random_text(text: str) -> None:
    survives(text.encode(), "a.txt")


@pytest.fixture(scope="module")
def original(stream: Callable[..., Events], tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], bytes]:
    """Return a function that gives the bytes of a sound file of each format."""
    folder = tmp_path_factory.mktemp("originals")
    events = stream(n=120)
    for name in ("a.npz", "a.npy", "a.csv", "a.raw"):
        write_events(folder / name, events)
    np.savez_compressed(folder / "b.npz", t=events.t, x=events.x, y=events.y, p=events.p)
    rows = np.stack([events.t, events.x, events.y, events.p], axis=1)
    np.save(folder / "plain.npy", np.asfortranarray(rows))
    np.savetxt(folder / "a.txt", rows)
    words = [0x8001, 0x6001, 0x0003, *(0x2000 | int(x) for x in events.x), 0x3801, 0x4FFF, 0x50FF, 0x8002, 0x6003]
    (folder / "b.raw").write_bytes(b"% evt 3.0\n% geometry 64x48\n% end\n" + np.array(words, "<u2").tobytes())
    pairs = np.stack([events.t, events.x.astype(np.int64) | events.y.astype(np.int64) << 14], axis=1).astype("<u4")
    (folder / "a.dat").write_bytes(HEADERS[5] + pairs.tobytes())
    records = np.stack([events.x.astype(np.int64) << 1 | events.y.astype(np.int64) << 8, events.t], axis=1).astype(
        ">u4"
    )
    (folder / "a.aedat").write_bytes(HEADERS[6] + records.tobytes())
    return lambda name: (folder / name).read_bytes()


NAMES = ["a.npz", "b.npz", "a.npy", "plain.npy", "a.csv", "a.txt", "a.raw", "b.raw", "a.dat", "a.aedat"]


@pytest.mark.parametrize("name", NAMES)
def test_the_originals_are_read_whole(name: str, original: Callable[[str], bytes]) -> None:
    assert survives(original(name), name) >= 120


@pytest.mark.parametrize("name", NAMES)
@given(data=st.data())
@settings(max_examples=60)
def test_truncation_anywhere(name: str, original: Callable[[str], bytes], data: st.DataObject) -> None:
    content = original(name)
    kept = survives(content[: data.draw(st.integers(0, len(content) - 1))], name)
    assert kept <= 141


@pytest.mark.parametrize("name", NAMES)
@given(data=st.data())
@settings(max_examples=100)
def test_flipped_bits(name: str, original: Callable[[str], bytes], data: st.DataObject) -> None:
    content = bytearray(original(name))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1) | st.integers(0, min(200, len(content) - 1)))
        content[at] ^= 1 << data.draw(st.integers(0, 7))
    survives(bytes(content), name)


@given(
    off=st.sampled_from([0, -1]),
    precision=st.sampled_from([np.float16, np.float32, np.float64, np.longdouble]),
    row=st.integers(0, 119),
    column=st.sampled_from("txyp"),
    odd=st.sampled_from([np.nan, np.inf, -np.inf, 0.5, 3.0, -7.0, 6e4]),
    name=st.sampled_from(["a.npz", "a.npy"]),
)
@settings(max_examples=300)
def test_one_odd_number_costs_no_row_before_it(
    off: int,
    precision: type[np.floating[Any]],
    row: int,
    column: str,
    odd: float,
    name: str,
    stream: Callable[..., Events],
) -> None:
    events = stream(n=120, start_us=0, step_us=9)
    columns = {key: getattr(events, key).astype(precision) for key in "txyp"}
    columns["p"] = np.where(events.p == 1, 1, off).astype(precision)
    columns[column][row] = odd
    buffer = io.BytesIO()
    if name == "a.npz":
        np.savez(buffer, **columns)
    else:
        np.save(buffer, np.stack([columns[key] for key in "txyp"], axis=1))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        kept = survives(buffer.getvalue(), name, columns="txyp", width=64, height=48)
    # A time that is only far off is sorted in, or too late; a coordinate of 3 is one like any other.
    sound = {"t": np.isfinite(odd), "x": odd == 3, "y": odd == 3, "p": False}[column]
    assert kept in ((row, 120) if column == "t" and sound else (120,) if sound else (row,))
