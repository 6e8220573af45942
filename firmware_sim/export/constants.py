"""Turn a configuration into the whole numbers that a device is built with: ticks, bits, squared px."""

from __future__ import annotations

from dataclasses import dataclass

from tiegocancel.firmware_sim.export.layout import EVENTS, SCHEDULE, cell_word, ring_word, state_of, vector_words
from tiegocancel.firmware_sim.export.vectors import Vectors
from tiegocancel.firmware_sim.export.words import Word

from tiegocancel.motion.schedule import FRACTION_BITS

__all__ = ["Constant", "constants"]


@dataclass(frozen=True, slots=True)
class Constant:
    """One number or one list of numbers, with a line that says what it is. ASCII.

    ``signed``: it can be negative, whatever it happens to be.
    """

    name: str
    value: int | tuple[int, ...]
    text: str
    signed: bool = False


def constants(vectors: Vectors) -> list[Constant]:
    """Return every parameter of the vectors, in the order in which files list them."""
    config, events = vectors.config, vectors.events
    state = state_of(vectors)
    words = vector_words(vectors)
    tick = config.tick_bits

    def ticks(values_us: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(value >> tick for value in values_us)

    columns, rows = config.set_bits or (0, 0)
    dx, dy = zip(*config.offsets, strict=True)
    return [
        Constant("width", events.width, "px"),
        Constant("height", events.height, "px"),
        Constant(
            "time_base_us", vectors.time_base_us, "added to a packet's time gives that of the recording", signed=True
        ),
        *_widths("event", words[EVENTS]),
        *_widths("schedule", words[SCHEDULE]),
        Constant("coefficient_fraction_bits", FRACTION_BITS, "of a to f"),
        Constant("schedule_entries", len(vectors.schedules[0]), "for each horizon"),
        Constant("plain_rule", int(config.is_plain), "1: the plain rule of the semantics is all"),
        Constant("tick_bits", tick, "a tick is 2^tick_bits us"),
        Constant("horizons", len(config.horizons_us), "how many"),
        Constant("horizon_ticks", ticks(config.horizons_us), "rising"),
        Constant(
            "early_ticks", config.early_gate_us >> tick, "gate before the predicted time, when entries are passed"
        ),
        Constant("late_ticks", ticks(config.late_gates_us), "gate after the predicted time: of OFF, of ON"),
        Constant("reach_squared_px", config.reaches_squared_px, "largest dx*dx + dy*dy: of OFF, of ON"),
        Constant("polarity_flip", int(config.polarity == "equal"), "1: a prediction meets the other polarity"),
        Constant("polarity_any", int(config.polarity == "ignore"), "1: a prediction meets both polarities"),
        Constant("carry", config.carry, "most support that an event hands on"),
        Constant("need", config.need, "least support that suppresses"),
        Constant("uses", config.uses, "hits that a cell can bear, 0 = any number"),
        Constant("bin_bits", config.bin_bits, "a cell serves 2^bin_bits x 2^bin_bits px"),
        Constant("bin_columns", ((events.width - 1) >> config.bin_bits) + 1, "of the sensor"),
        Constant("bin_rows", ((events.height - 1) >> config.bin_bits) + 1, "of the sensor"),
        Constant("set_column_bits", columns, "low bits of a bin's column that name its set"),
        Constant("set_row_bits", rows, "low bits of a bin's row that name its set"),
        Constant("ways", 0 if config.set_bits is None else config.ways, "cells of a set, 0 = a cell for every bin"),
        Constant("least_shift_squared_px", config.least_shift_squared_px, "D: a prediction nearer is not made"),
        Constant("motion_at_gate", int(config.motion_at == "gate"), "1: the motion of the time when the gate opens"),
        Constant("choose_squared_px", config.choose_squared_px, "Q: 0 = no choice among horizons"),
        Constant("spread", int(config.spreads), "1: window offsets ask for a least shift"),
        Constant("line_limit", config.line_limit if config.lines else 0, "largest residual, where line is 1"),
        Constant("line", int(config.lines), "1: an event must lie near its prediction's line"),
        Constant("fraction_bits", config.fraction_bits, "of the place in a cell, below the px"),
        Constant("rings", len(config.ring_capacities), "how many"),
        Constant("ring_capacity", config.ring_capacities, "entries of each ring"),
        Constant("ring_entry_bits", state.ring_entry, "width of an entry"),
        *_places("ring_entry", ring_word(vectors)),
        Constant("ring_index_bits", state.index, "where in the ring each tick begins; 0: entries hold their time"),
        Constant("cells", state.cells, "of the table"),
        Constant("cell_bits", state.cell, "width of a cell"),
        *_places("cell", cell_word(vectors)),
        Constant("sweep_ticks", state.sweep_ticks, "every cell is looked at once in so many; 0 = no sweep"),
        Constant("state_bits", state.total, "rings and table together"),
        Constant("window", len(config.offsets), "offsets of a match"),
        Constant("window_dx", dx, "in order of preference", signed=True),
        Constant("window_dy", dy, "in order of preference", signed=True),
        Constant("window_least_shift_squared_px", config.spread_shifts_squared, "least shift that asks for each"),
    ]


def _widths(prefix: str, word: Word) -> list[Constant]:
    """Return the widths of a word's fields; fields of one letter from a to f share one."""
    widths = {
        "coefficient_bits" if one.name in "abcdef" else f"{prefix}_{one.name}_bits": one.bits for one in word.fields
    }
    return [Constant(name, bits, f"in a word of {word.bits}") for name, bits in widths.items()]


def _places(prefix: str, word: Word) -> list[Constant]:
    """Return where each field of a word lies."""
    return [
        one
        for field, at in word.placed()
        for one in (
            Constant(f"{prefix}_{field.name}_lsb", at, field.text),
            Constant(f"{prefix}_{field.name}_width", field.bits, "bits"),
        )
    ]
