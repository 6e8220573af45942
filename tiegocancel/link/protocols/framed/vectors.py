"""Write test vectors of the framed protocol for other implementations: frames in hex, and what is in them."""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tiegocancel.events import Events
from tiegocancel.link.protocols.framed.encoder import FramedEncoder
from tiegocancel.link.protocols.framed.frame import Kind, seal_frame
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["vectors"]


def vectors() -> dict[str, Any]:
    """Return streams, each a name, the bytes of the line in hex, and the events, decisions or text that they carry."""
    streams = [_of_events(name, events, options) for name, events, options in _cases()]
    encoder = FramedEncoder(ProtocolOptions(width=320, height=320))
    suppressed = np.array([True, False, False, True, True, False, True, True, False, True])
    streams += [
        {"name": "decisions", "line": encoder.decisions(65_530, suppressed).hex(), "first": 65_530,
         "suppressed": suppressed.astype(int).tolist()},
        {"name": "text", "line": encoder.text("-S10 0 FFFF0000 00010000").hex(), "text": "-S10 0 FFFF0000 00010000"},
        {"name": "ask", "line": seal_frame(Kind.ASK, 0, b"").hex()},
        {"name": "start with 8 frames of credit", "line": seal_frame(Kind.START, 1, b"\x01\x08\x00").hex()},
        {"name": "credit up to frame 300", "line": seal_frame(Kind.CREDIT, 2, b"\x2c\x01").hex()},
        {"name": "stop", "line": seal_frame(Kind.STOP, 3, b"").hex()},
    ]  # fmt: skip
    return {
        "about": "framed events, version 1; made by python -m tiegocancel.link.protocols.framed.vectors",
        "crc_check": "the CRC of the ASCII digits 123456789 is 29b1",
        "streams": streams,
    }


def _cases() -> list[tuple[str, Events, ProtocolOptions]]:
    rng = np.random.default_rng(6)
    near = range(12)
    scattered_us = np.sort(rng.integers(0, 9, 20)) + 4_294_967_290
    scattered = (rng.integers(0, 1280, 20), rng.integers(0, 720, 20), rng.integers(0, 2, 20))
    plain = ProtocolOptions()
    row = ([1000] * 12, [40 + 3 * x for x in near], [7] * 12, [x % 2 for x in near])
    steps = ([0, 1, 2, 900, 901], [9] * 5, [9] * 5, [0, 1, 0, 1, 0])
    pause = ([10, 20, 30, 40, 50, 2_000_000], [1, 2, 3, 4, 5, 6], [6] * 6, [1] * 6)
    return [
        ("one event", _events(([5], [3], [2], [1]), 8, 4), plain),
        ("a row of one tick", _events(row, 640, 480), plain),
        ("steps in time with flags", _events(steps, 128, 128), plain),
        ("scattered over 1280x720", _events((scattered_us, *scattered), 1280, 720), plain),
        ("a pause, and frames of 4 events", _events(pause, 16, 16), ProtocolOptions(frame_events=4)),
        (
            "ticks of 20 ns",
            _events(([100, 101, 103], [0, 319, 160], [319, 0, 160], [1, 0, 1]), 320, 320),
            ProtocolOptions(tick_ns=20),
        ),
    ]


def _events(columns: tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike], width: int, height: int) -> Events:
    t, x, y, p = (np.asarray(column) for column in columns)
    return Events(t, x, y, p, width, height)


def _of_events(name: str, events: Events, options: ProtocolOptions) -> dict[str, Any]:
    encoder = FramedEncoder(options, name="vectors")
    line = encoder.begin() + encoder.encode(events) + encoder.end()
    return {
        "name": name,
        "line": line.hex(),
        "width": events.width,
        "height": events.height,
        "t_us": events.t.tolist(),
        "x": events.x.tolist(),
        "y": events.y.tolist(),
        "on": events.p.tolist(),
    }


if __name__ == "__main__":
    sys.stdout.write(json.dumps(vectors(), indent=1) + "\n")
