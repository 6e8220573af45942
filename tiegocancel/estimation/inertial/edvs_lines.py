"""Read the gyroscope's text lines that an eDVS mixes into its event stream, as they come or from a log of them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from tiegocancel.errors import InputError
from tiegocancel.estimation.inertial.gyro import GyroSamples
from tiegocancel.events import MAX_TIME_US
from tiegocancel.files.source import open_source

__all__ = ["RAW_STEP_RAD_S", "EdvsGyro", "EdvsLine", "gyro_of_lines", "is_edvs_log", "parse_edvs_line", "read_edvs_log"]

RAW_STEP_RAD_S = math.radians(2000.0 / 32768.0)
"""One count of the raw gyroscope: 16 bits over ±2000 degrees a second."""

_CALIBRATED_STEP_RAD_S = math.radians(1.0 / 65536.0)
_RAW, _CALIBRATED = "7", "10"
_HEX = re.compile(r"[0-9A-Fa-f]{1,8}", re.ASCII)
_DECIMAL = re.compile(r"[+-]?[0-9]{1,5}", re.ASCII)
_TAG = re.compile(r"-S([0-9]{1,2})", re.ASCII)
_LOGGED = re.compile(r"\s*(-?[0-9]{1,19})\s+(\S.*?)\s*", re.ASCII)
_FIRST = re.compile(rb"(?:\xef\xbb\xbf)?(?:\s*#[^\n]*\n)*\s*-?[0-9]{1,19}[ \t]+-[A-Z]", re.ASCII)

Kind = Literal["gyro", "other", "malformed"]


@dataclass(frozen=True, slots=True)
class EdvsLine:
    """One line: ``kind`` and, for ``gyro``, the rate about the device's x, y and z in rad/s."""

    kind: Kind
    rate_rad_s: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class EdvsGyro:
    """The samples of many lines, ``None`` when there was none, and a count of what happened to the lines.

    ``other``: replies and other sensors; ``malformed``: gyro lines that a lost byte spoilt; ``merged``: samples that
    bore the time of another and were averaged with it; ``late``: samples before the one ahead of them, left out.
    """

    samples: GyroSamples | None
    lines: int
    other: int
    malformed: int
    merged: int
    late: int


def parse_edvs_line(line: str) -> EdvsLine:
    """Read one reply ``-S<sensor> v1 v2 v3``; never raise.

    ``-S10`` is the calibrated gyroscope in degrees a second, each value a signed 32-bit number in hex with 16
    fractional bits; ``-S7`` the raw one, signed decimal counts of :data:`RAW_STEP_RAD_S`. Every other sensor and reply
    is ``other``. Source: iniVation's eDVS user guide and the published drivers; not checked against a device.
    """
    words = line.split()
    if not words:
        return EdvsLine("other")
    tag = _TAG.fullmatch(words[0])
    if tag is None:
        # A reply that lost its blank or its end still begins like one.
        spoilt = words[0].startswith((f"-S{_CALIBRATED}", f"-S{_RAW}"))
        return EdvsLine("malformed" if spoilt else "other")
    if tag[1] not in (_RAW, _CALIBRATED):
        return EdvsLine("other")
    calibrated = tag[1] == _CALIBRATED
    form = _HEX if calibrated else _DECIMAL
    if len(words) != 4 or not all(form.fullmatch(word) for word in words[1:]):
        return EdvsLine("malformed")
    if calibrated:
        unsigned = [int(word, 16) for word in words[1:]]
        x, y, z = ((value - (1 << 32 if value >> 31 else 0)) * _CALIBRATED_STEP_RAD_S for value in unsigned)
    else:
        counts = [int(word) for word in words[1:]]
        if not all(-32768 <= count <= 32767 for count in counts):
            return EdvsLine("malformed")
        x, y, z = (count * RAW_STEP_RAD_S for count in counts)
    return EdvsLine("gyro", (x, y, z))


def gyro_of_lines(lines: Iterable[tuple[int, str]], *, source: str = "eDVS gyroscope") -> EdvsGyro:
    """Collect samples from lines, each with the time in µs of the last event before it.

    The lines carry no time of their own: while no events come, several bear the same time. Axes are the device's; see
    :meth:`GyroSamples.rotated`.
    """
    times: list[int] = []
    sums: list[np.ndarray] = []
    counts: list[int] = []
    tally = {"other": 0, "malformed": 0, "merged": 0, "late": 0}
    total = 0
    for t_us, line in lines:
        total += 1
        parsed = parse_edvs_line(line)
        if parsed.kind != "gyro":
            tally[parsed.kind] += 1
            continue
        if times and t_us < times[-1]:
            tally["late"] += 1
        elif times and t_us == times[-1]:
            tally["merged"] += 1
            sums[-1] = sums[-1] + np.array(parsed.rate_rad_s)
            counts[-1] += 1
        else:
            times.append(t_us)
            sums.append(np.array(parsed.rate_rad_s))
            counts.append(1)
    samples = None
    if times:
        notes = tuple(
            f"{count} line(s) of the gyroscope {name}" for name, count in tally.items() if count and name != "other"
        )
        rates = np.array(sums) / np.array(counts, np.float64)[:, None]
        samples = GyroSamples(t_us=np.array(times, np.int64), rate_rad_s=rates, source=source, notes=notes)
    return EdvsGyro(samples=samples, lines=total, **tally)


def is_edvs_log(start: bytes) -> bool:
    """Tell by its first bytes whether a file is a log of replies, each after its time."""
    return _FIRST.match(start) is not None


def read_edvs_log(path: Path) -> GyroSamples:
    """Read lines ``t_us reply``, for instance ``1200 -S10 0000a000 00000000 fffe0000``, in the device's axes.

    The time is that of the last event before the reply, in whole µs. Comments begin with ``#``; other replies are
    passed over, and notes count gyroscope lines that are spoilt, late or share a time. Raise ``InputError`` naming the
    row that has no time, or when no line of a gyroscope is there.
    """
    with open_source(path) as source:
        try:
            text = source.read().decode("utf-8-sig", errors="replace")  # a lost byte spoils a line, not a log
        except OSError as error:
            raise InputError(path, "", f"cannot be read: {error.strerror or error}") from None
    lines: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        found = _LOGGED.fullmatch(line)
        if found is None or abs(int(found[1])) > MAX_TIME_US:
            raise InputError(
                path, f"row {number}", f"expected a time in whole µs and a reply, found {line.strip()[:60]!r}"
            )
        lines.append((int(found[1]), found[2]))
    gyro = gyro_of_lines(lines, source=path.name)
    if gyro.samples is None:
        raise InputError(path, "", f"holds no line of a gyroscope (-S7, -S10) among {gyro.lines}")
    return gyro.samples
