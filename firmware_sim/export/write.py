"""Write a folder of golden vectors: memory images, C headers, JSON and the text that explains them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tiegocancel.firmware_sim.export.c_header import CONFIG_HEADER, VECTORS_HEADER, config_header, vectors_header
from tiegocancel.firmware_sim.export.constants import constants
from tiegocancel.firmware_sim.export.layout import (
    CYCLES,
    DECISIONS,
    EVENTS,
    SCHEDULE,
    cell_word,
    ring_word,
    vector_words,
)
from tiegocancel.firmware_sim.export.readme import readme_text
from tiegocancel.firmware_sim.export.vectors import Vectors
from tiegocancel.firmware_sim.export.verilog_header import VERILOG_HEADER, verilog_header
from tiegocancel.firmware_sim.export.words import memh_text

import tiegocancel

__all__ = ["CONFIG", "FILES", "FORMAT", "README", "VECTORS", "VERSION", "columns_of", "write_vectors"]

CONFIG, VECTORS, README = "config.json", "vectors.json", "README.txt"
FILES = (EVENTS, DECISIONS, SCHEDULE, CYCLES, CONFIG, CONFIG_HEADER, VERILOG_HEADER, VECTORS_HEADER, README, VECTORS)
"""Every file that can be written; ``cycles.memh`` is where a core was simulated."""
FORMAT, VERSION = "tiegocancel vectors", 1


def write_vectors(folder: Path, vectors: Vectors, *, command: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Write every file into ``folder``, which exists; return bytes and SHA-256 of each by its name.

    ``vectors.json`` comes last and lists the others with their checksums.
    """
    written = {}
    for name, text in _texts(vectors):
        written[name] = _write(folder / name, text)
    table = {
        "format": FORMAT,
        "version": VERSION,
        "tiegocancel": tiegocancel.__version__,
        "command": list(command),
        "files": written,
        **columns_of(vectors),
    }
    # One line a column: the file is for programs, and a person can still find the command.
    text = "{\n" + ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in table.items()) + "\n}\n"
    return {**written, VECTORS: _write(folder / VECTORS, text)}


def columns_of(vectors: Vectors) -> dict[str, Any]:
    """Return the numbers of the vectors as JSON holds them, times as those of the recording."""
    events = vectors.events
    columns: dict[str, Any] = {
        "events": {
            "t_us": events.t.tolist(),
            "x": events.x.tolist(),
            "y": events.y.tolist(),
            "p": events.p.tolist(),
        },
        "counters": dict(vectors.counters),
        "decisions": {
            "suppressed": vectors.suppressed.astype(int).tolist(),
            "support": vectors.support.tolist(),
        },
        "schedules": [
            {"horizon_us": one.horizon_us, "t_us": one.t_us.tolist(), "coefficients": one.coefficients.tolist()}
            for one in vectors.schedules
        ],
    }
    if vectors.cycles is not None:
        columns["cycles"] = {
            "clock_hz": vectors.cycles.clock_hz,
            "dropped": vectors.cycles.dropped.astype(int).tolist(),
            "suppressed": vectors.cycles.suppressed.astype(int).tolist(),
            "arrival": vectors.cycles.arrival.tolist(),
            "decided": vectors.cycles.decided.tolist(),
        }
    return columns


def _texts(vectors: Vectors) -> Iterator[tuple[str, str]]:
    """Yield name and text of each file but ``vectors.json``."""
    events, base_us = vectors.events, vectors.time_base_us
    words = vector_words(vectors)
    columns = (events.t - base_us, events.x, events.y, events.p)
    yield (
        EVENTS,
        memh_text(
            f"tiegocancel events, time base {base_us} us",
            words[EVENTS],
            zip(*(column.tolist() for column in columns), strict=True),
        ),
    )
    yield (
        DECISIONS,
        memh_text(
            "tiegocancel decisions, from an empty state on",
            words[DECISIONS],
            zip(vectors.suppressed.tolist(), vectors.support.tolist(), strict=True),
        ),
    )
    yield (
        SCHEDULE,
        memh_text(
            f"tiegocancel schedule, {len(vectors.schedules[0])} entries for each of {len(vectors.schedules)} horizons, "
            f"time base {base_us} us",
            words[SCHEDULE],
            (
                (time - base_us, *row)
                for one in vectors.schedules
                for time, row in zip(one.t_us.tolist(), one.coefficients.tolist(), strict=True)
            ),
        ),
    )
    if vectors.cycles is not None:
        cycles = vectors.cycles
        yield (
            CYCLES,
            memh_text(
                f"tiegocancel cycles at {cycles.clock_hz:g} Hz",
                words[CYCLES],
                zip(
                    cycles.dropped.tolist(),
                    cycles.suppressed.tolist(),
                    cycles.arrival.tolist(),
                    [max(cycle, 0) for cycle in cycles.decided.tolist()],
                    strict=True,
                ),
            ),
        )
    yield CONFIG, json.dumps(_config_table(vectors), indent=2) + "\n"
    yield CONFIG_HEADER, config_header(constants(vectors))
    yield VERILOG_HEADER, verilog_header(constants(vectors))
    yield VECTORS_HEADER, vectors_header(vectors)
    yield README, readme_text(vectors, words)


def _config_table(vectors: Vectors) -> dict[str, Any]:
    """Return what ``config.json`` holds."""
    config, events = vectors.config, vectors.events
    table: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "tiegocancel": tiegocancel.__version__,
        "sensor": {"width": events.width, "height": events.height},
        "events": len(events),
        "time_base_us": vectors.time_base_us,
        "tick_us": 1 << config.tick_bits,
        "parameters": {one.name: one.value for one in constants(vectors)},
        "window": [
            {"dx": dx, "dy": dy, "squared_px": dx * dx + dy * dy, "least_shift_squared_px": least}
            for (dx, dy), least in zip(config.offsets, config.spread_shifts_squared, strict=True)
        ],
        "state": {
            "ring_entry": ring_word(vectors).to_json(),
            "cell": cell_word(vectors).to_json(),
        },
        "words": {name: word.to_json() for name, word in vector_words(vectors).items()},
        "counters": dict(vectors.counters),
        "cancel": asdict(config),
    }
    if vectors.cycles is not None:
        table["core"] = {
            "clock_hz": vectors.cycles.clock_hz,
            "stamp_bits": vectors.cycles.stamp_bits,
            "scrub_cycles": vectors.cycles.scrub_cycles,
            "build": asdict(vectors.cycles.core),
        }
    return table


def _write(path: Path, text: str) -> dict[str, Any]:
    """Write ASCII with plain line ends, and return bytes and SHA-256 of what was written."""
    data = text.encode("ascii")
    path.write_bytes(data)
    return {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
