"""Read the gyroscope of AEDAT 4.0 files that are built here byte by byte; compare with other decoders on a real one."""

from __future__ import annotations

import builtins
import contextlib
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.errors import InputError, MissingExtraError
from tiegocancel.estimation.inertial.aedat4 import read_aedat4_gyro
from tiegocancel.estimation.inertial.files import read_gyro

LZ4, ZSTD = 1, 3
ROWS = [(1_589_163_147_000_000 + 1000 * k, (float(k), -2.0 * k, 90.0)) for k in range(5)]


def table(fields):
    """Return a table of (number, bytes) fields with its description before it, and the place of the table."""
    highest = max((number for number, _ in fields), default=-1)
    places, body = [0] * (highest + 1), b""
    for number, content in fields:
        places[number] = 4 + len(body)
        body += content
    layout = struct.pack("<HH", 4 + 2 * len(places), 4 + len(body)) + struct.pack(f"<{len(places)}H", *places)
    layout += b"\0" * (-len(layout) % 4)
    return layout + struct.pack("<i", len(layout)) + body, len(layout)


def samples_buffer(rows, identifier=b"IMUS"):
    """Return a packet of inertial samples: a flat buffer after its size."""
    root, place = table([(0, struct.pack("<I", 4))])
    head = struct.pack("<I", 8 + place) + identifier + root
    offsets = b""
    parts = b""
    for index, (t_us, degrees_s) in enumerate(rows):
        part, inner = table(
            [(0, struct.pack("<q", t_us)), (1, struct.pack("<f", 25.0))]
            + [(5 + axis, struct.pack("<f", rate)) for axis, rate in enumerate(degrees_s) if rate]
        )
        # From the place of this offset, over the offsets after it and the parts before, to the table.
        offsets += struct.pack("<I", 4 * (len(rows) - index) + len(parts) + inner)
        parts += part
    buffer = head + struct.pack("<I", len(rows)) + offsets + parts
    return struct.pack("<I", len(buffer)) + buffer


def packed(data, compression):
    if compression == LZ4:
        return pytest.importorskip("lz4.frame").compress(data)
    if compression == ZSTD:
        return pytest.importorskip("zstandard").ZstdCompressor().compress(data)
    return data


def xml(*kinds):
    nodes = "".join(
        f'<node name="{number}"><attr key="typeIdentifier" type="string">{kind}</attr></node>'
        for number, kind in enumerate(kinds)
    )
    return f'<dv version="2.0"><node name="outInfo" path="/m/outInfo/">{nodes}</node></dv>'


def aedat4(packets, *, compression=0, info=None, closed=False):
    """Return a file; ``packets`` are (stream, body); ``closed`` writes the place of the table behind them."""
    text = (xml("EVTS", "IMUS") if info is None else info).encode()

    def header(position):
        root, place = table([(0, struct.pack("<i", compression)), (1, struct.pack("<q", position)), (2, b"\4\0\0\0")])
        buffer = struct.pack("<I", 8 + place) + b"IOHE" + root + struct.pack("<I", len(text)) + text
        return b"#!AER-DAT4.0\r\n" + struct.pack("<I", len(buffer)) + buffer

    body = b"".join(struct.pack("<ii", stream, len(content)) + content for stream, content in packets)
    if not closed:
        return header(-1) + body
    return header(len(header(0)) + len(body)) + body + b"table of packets"


@pytest.fixture
def saved(tmp_path):
    def save(content):
        path = tmp_path / "recording.aedat4"
        path.write_bytes(content)
        return path

    return save


@pytest.mark.parametrize("compression", [0, LZ4, 2, ZSTD, 4])
@pytest.mark.parametrize("closed", [False, True])
def test_every_compression_gives_the_samples(saved, compression, closed):
    kind = {2: LZ4, 4: ZSTD}.get(compression, compression)
    packets = [(1, packed(samples_buffer(ROWS[:2]), kind)), (0, b"events, never looked at"),
               (1, packed(samples_buffer(ROWS[2:]), kind))]  # fmt: skip
    read = read_aedat4_gyro(saved(aedat4(packets, compression=compression, closed=closed)))
    assert read.t_us.tolist() == [t_us for t_us, _ in ROWS]
    assert np.array_equal(read.rate_rad_s, np.radians([rate for _, rate in ROWS]))


def test_axes_default_to_those_of_the_maker(saved):
    path = saved(aedat4([(1, samples_buffer([(7, (10.0, 20.0, 30.0))]))]))
    assert read_gyro(path).rate_rad_s[0] == pytest.approx(np.radians([-10.0, 20.0, -30.0]))
    assert read_gyro(path, axes="x,y,z").rate_rad_s[0] == pytest.approx(np.radians([10.0, 20.0, 30.0]))
    assert "-x,y,-z" in read_gyro(path).notes[-1]


def test_first_inertial_stream_is_read_and_others_noted(saved):
    packets = [(2, samples_buffer(ROWS[:1])), (0, samples_buffer(ROWS[1:3]))]
    read = read_aedat4_gyro(saved(aedat4(packets, info=xml("IMUS", "FRME", "IMUS"))))
    assert len(read) == 2
    assert read.notes == ("inertial stream 0 of the recording", "inertial streams [2] were left out")


WHOLE = aedat4([(1, samples_buffer(ROWS[:2])), (1, samples_buffer(ROWS[2:]))])
START = len(aedat4([]))
SECOND = START + 8 + len(samples_buffer(ROWS[:2]))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"#!AER-DAT4.0\r\n", "byte 0: found"),
        (WHOLE[:60], "byte 14: header of"),
        (WHOLE[:-1], f"byte {SECOND}: packet of .* bytes, and .* are left"),
        (WHOLE + b"\1\0\0", f"byte {len(WHOLE)}: ends before its last packet"),
        (aedat4([(1, b"")]), f"packet at byte {START}: holds 0 bytes"),
        (aedat4([(1, samples_buffer(ROWS)[:-4])]), f"packet at byte {START}: holds .* fewer than it says"),
        (aedat4([(1, samples_buffer(ROWS, b"EVTS"))]), "broken flat buffer: found b'EVTS', expected 'IMUS'"),
        (aedat4([(1, b"not lz4")], compression=LZ4), f"packet at byte {START}: cannot be decompressed"),
        (aedat4([(1, b"not zstd")], compression=ZSTD), f"packet at byte {START}: cannot be decompressed"),
        (aedat4([(1, b"")], compression=9), "byte 18: compression 9 is not known"),
        (aedat4([], info=xml("EVTS")), "has no inertial stream"),
        (aedat4([], info="<dv>"), "broken list of streams"),
        (aedat4([], info='<!DOCTYPE a [<!ENTITY b "c">]><dv/>'), "declares entities"),
        (aedat4([]), "no sample in it"),
        (aedat4([(1, samples_buffer([(7, (float("nan"), 0.0, 1.0))]))]), "sample 0: .* not a measurement"),
        (aedat4([(1, samples_buffer([(1 << 62, (0.0, 0.0, 1.0))]))]), "sample 0: .* not a measurement"),
    ],
)
def test_a_fault_is_one_line_with_its_place(saved, content, message):
    pytest.importorskip("lz4")
    pytest.importorskip("zstandard")
    with pytest.raises(InputError, match=message) as caught:
        read_aedat4_gyro(saved(content))
    assert "\n" not in str(caught.value)


def test_lz4_that_breaks_off_or_grows_without_bound_is_refused(saved):
    lz4 = pytest.importorskip("lz4.frame")
    whole = lz4.compress(samples_buffer(ROWS))
    for body in (whole[:-6], lz4.compress(bytes(20 << 20))):
        with pytest.raises(InputError, match="ends early, or grows beyond"):
            read_aedat4_gyro(saved(aedat4([(1, body)], compression=LZ4)))


def test_zstd_that_grows_without_bound_is_refused(saved):
    zstandard = pytest.importorskip("zstandard")
    with pytest.raises(InputError, match=r"grows beyond|cannot be decompressed"):
        read_aedat4_gyro(saved(aedat4([(1, zstandard.compress(bytes(20 << 20)))], compression=ZSTD)))


def test_keep_going_returns_what_came_before_the_fault(saved):
    read = read_gyro(saved(WHOLE[:-1]), keep_going=True)
    assert read.t_us.tolist() == [t_us for t_us, _ in ROWS[:2]]
    assert any(f"stopped at a fault: byte {SECOND}" in note for note in read.notes)


@given(cut=st.integers(0, len(WHOLE)), place=st.integers(0, len(WHOLE) - 1), value=st.integers(0, 255))
def test_no_damage_makes_it_crash(tmp_path_factory, cut, place, value):
    spoilt = bytearray(WHOLE)
    spoilt[place] = value
    path = tmp_path_factory.mktemp("fuzz") / "recording.aedat4"
    for content in (WHOLE[:cut], bytes(spoilt)):
        path.write_bytes(content)
        with contextlib.suppress(InputError):
            read_gyro(path, keep_going=bool(cut % 2))


@given(offsets=st.lists(st.integers(0, (1 << 32) - 1), min_size=1, max_size=40))
def test_no_flat_buffer_makes_it_crash(tmp_path_factory, offsets):
    body = b"\0\0\0\0" + struct.pack("<I", offsets[0] % 200) + b"IMUS" + struct.pack(f"<{len(offsets)}I", *offsets)
    path = tmp_path_factory.mktemp("fuzz") / "recording.aedat4"
    path.write_bytes(aedat4([(1, body)]))
    with contextlib.suppress(InputError):
        read_gyro(path)


def test_missing_decompressor_names_the_extra(saved, monkeypatch):
    plain = builtins.__import__

    def without(name, *arguments, **more):
        if name.split(".")[0] in ("lz4", "zstandard"):
            raise ImportError(name)
        return plain(name, *arguments, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    for compression, package in ((LZ4, "lz4"), (ZSTD, "zstandard")):
        with pytest.raises(
            MissingExtraError, match=rf"needs the package {package}: pip install 'tiegocancel\[files\]'"
        ):
            read_aedat4_gyro(saved(aedat4([(1, b"")], compression=compression)))


@pytest.mark.parametrize("decoder", ["aedat", "faery"])
def test_real_recording_equals_other_decoders(recording, decoder):
    pytest.importorskip("lz4")
    other = pytest.importorskip(decoder)
    path = recording("davis346_imu.aedat4")
    decoded = other.Decoder(path) if decoder == "aedat" else other.aedat.Decoder(path)
    if decoder == "aedat":
        packets = [packet["imus"] for packet in decoded if "imus" in packet]
    else:
        packets = [packet for track, packet in decoded if track.data_type == "imus"]
    rows = np.concatenate(packets)
    mine = read_aedat4_gyro(path)
    assert len(mine) == 2363
    assert np.array_equal(mine.t_us, rows["t"].astype(np.int64))
    degrees = np.stack([rows[f"gyroscope_{axis}"] for axis in "xyz"], axis=1).astype(np.float64)
    assert np.array_equal(mine.rate_rad_s, np.radians(degrees))
