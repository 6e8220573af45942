"""Read a folder of golden vectors back, and hold its files to each other."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.export.layout import CYCLES, DECISIONS, EVENTS, SCHEDULE
from tiegocancel.firmware_sim.export.vectors import CoreCycles, Vectors
from tiegocancel.firmware_sim.export.words import Word, read_memh
from tiegocancel.firmware_sim.export.write import CONFIG, FORMAT, VECTORS, VERSION, columns_of

from tiegocancel.errors import InputError
from tiegocancel.events import Events
from tiegocancel.matching.canceller import Counters
from tiegocancel.matching.config import CancelConfig
from tiegocancel.motion.schedule import MotionSchedule

__all__ = ["read_vectors"]


def read_vectors(folder: Path) -> Vectors:
    """Return the vectors of a folder from its memory images and ``config.json``.

    Raise ``InputError`` for a file that is absent or torn, that is not what ``vectors.json`` has the SHA-256 of, or
    whose numbers are not those of ``vectors.json``.
    """
    listed = _table(folder / VECTORS)
    for name, record in _part(folder / VECTORS, listed, "files").items():
        path = folder / Path(name).name
        try:
            told = hashlib.sha256(path.read_bytes()).hexdigest()
        except OSError as error:
            raise InputError(path, "", f"cannot be read: {error.strerror}") from None
        if told != record["sha256"]:
            raise InputError(path, "", f"is not the file that {VECTORS} lists: its SHA-256 begins with {told[:12]}")
    config = _table(folder / CONFIG)
    try:
        vectors = _assembled(folder, config)
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(folder / CONFIG, "", f"does not fit the memory images beside it: {error}") from None
    columns = columns_of(vectors)
    for name, values in columns.items():
        if listed.get(name) != values:
            raise InputError(folder / VECTORS, f"'{name}'", "differs from the memory images beside it")
    return vectors


def _assembled(folder: Path, config: dict[str, Any]) -> Vectors:
    """Return the vectors that the memory images hold."""
    words = {name: Word.from_json(layout) for name, layout in config["words"].items()}
    base_us = config["time_base_us"]
    cancel = CancelConfig(**config["cancel"])
    t, x, y, p = _columns(folder, EVENTS, words)
    events = Events(t + base_us, x, y, p, config["sensor"]["width"], config["sensor"]["height"])
    suppressed, support = _columns(folder, DECISIONS, words)
    rows = np.array(read_memh(folder / SCHEDULE, words[SCHEDULE]), np.int64)
    entries = len(rows) // len(cancel.horizons_us)
    schedules = tuple(
        MotionSchedule(part[:, 0] + base_us, part[:, 1:], horizon_us)
        for part, horizon_us in zip(
            (rows[first : first + entries] for first in range(0, len(rows), entries)), cancel.horizons_us, strict=True
        )
    )
    cycles = None
    if CYCLES in words:
        dropped, decision, arrival, decided = _columns(folder, CYCLES, words)
        cycles = CoreCycles(
            core=CoreConfig(**config["core"]["build"]),
            clock_hz=config["core"]["clock_hz"],
            stamp_bits=config["core"]["stamp_bits"],
            scrub_cycles=config["core"]["scrub_cycles"],
            dropped=dropped.astype(np.bool_),
            suppressed=decision.astype(np.bool_),
            arrival=arrival,
            decided=np.where(dropped, -1, decided),
        )
    return Vectors(
        config=cancel,
        events=events,
        schedules=schedules,
        suppressed=suppressed.astype(np.bool_),
        support=support.astype(np.uint8),
        counters=Counters(**config["counters"]),
        cycles=cycles,
    )


def _columns(folder: Path, name: str, words: dict[str, Word]) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Return a memory image as int64[fields, words]."""
    rows = read_memh(folder / name, words[name])
    return np.array(rows, np.int64).reshape(len(rows), len(words[name].fields)).T


def _table(path: Path) -> dict[str, Any]:
    """Return a JSON file of this format."""
    try:
        table = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(path, "", f"cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise InputError(path, "", f"is not JSON: {error}") from None
    if not isinstance(table, dict) or (table.get("format"), table.get("version")) != (FORMAT, VERSION):
        raise InputError(path, "field 'format'", f"expected '{FORMAT}', version {VERSION}")
    return table


def _part(path: Path, table: dict[str, Any], name: str) -> dict[str, Any]:
    """Return a table within a table."""
    part = table.get(name)
    if not isinstance(part, dict) or not all(isinstance(one, dict) and "sha256" in one for one in part.values()):
        raise InputError(path, f"field '{name}'", "expected a table of files with their SHA-256")
    return part
