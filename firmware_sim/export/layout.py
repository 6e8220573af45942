"""Lay out what a device holds and what the vectors are packed into, bit by bit."""

from __future__ import annotations

from tiegocancel.firmware_sim.export.vectors import Vectors
from tiegocancel.firmware_sim.export.words import Field, Word, signed_bits, unsigned_bits
from tiegocancel.firmware_sim.state import StateBits, state_bits

__all__ = ["CYCLES", "DECISIONS", "EVENTS", "SCHEDULE", "cell_word", "ring_word", "state_of", "vector_words"]

EVENTS, DECISIONS, SCHEDULE, CYCLES = "events.memh", "decisions.memh", "schedule.memh", "cycles.memh"

_AXES = ("x", "y")


def vector_words(vectors: Vectors) -> dict[str, Word]:
    """Return the layout of each memory image by its file's name."""
    events, base_us = vectors.events, vectors.time_base_us
    last_us = max(int(events.t[-1]), int(vectors.schedules[0].t_us[-1]))
    time = Field(name="t_us", bits=unsigned_bits(last_us - base_us), text="us after the time base")
    most_support = len(vectors.config.horizons_us) + vectors.config.carry
    tables = [one.coefficients for one in vectors.schedules]
    width = signed_bits(min(int(one.min()) for one in tables), max(int(one.max()) for one in tables))
    words = {
        EVENTS: Word(
            (
                time,
                Field(name="x", bits=unsigned_bits(events.width - 1), text="column, px"),
                Field(name="y", bits=unsigned_bits(events.height - 1), text="row, px"),
                Field(name="p", bits=1, text="1 = ON, 0 = OFF"),
            )
        ),
        DECISIONS: Word(
            (
                Field(name="suppressed", bits=1, text="1 = the event is not sent on"),
                Field(name="support", bits=unsigned_bits(most_support), text="S of the semantics, 0 without candidate"),
            )
        ),
        SCHEDULE: Word(
            (
                time,
                *(Field(name=name, bits=width, signed=True, text="16 fractional bits") for name in "abcdef"),
            )
        ),
    }
    if vectors.cycles is not None:
        counted = unsigned_bits(max(int(vectors.cycles.arrival.max()), int(vectors.cycles.decided.max())))
        words[CYCLES] = Word(
            (
                Field(name="dropped", bits=1, text="1 = the input FIFO was full"),
                Field(name="suppressed", bits=1, text="what the core decides, drops included"),
                Field(name="arrival", bits=counted, text="cycle of the arrival, the first event's time is 0"),
                Field(name="decided", bits=counted, text="cycle of the decision, 0 where dropped"),
            )
        )
    return words


def state_of(vectors: Vectors) -> StateBits:
    """Return the widths and totals of the state, with the stamps of the core where there is one."""
    return state_bits(
        vectors.config,
        width=vectors.events.width,
        height=vectors.events.height,
        time_bits=None if vectors.cycles is None else vectors.cycles.stamp_bits,
    )


def ring_word(vectors: Vectors) -> Word:
    """Return the layout of a ring entry: a prediction under the plain rule, otherwise an event.

    The widths are those of :func:`tiegocancel.firmware_sim.state.state_bits`.
    """
    config, state = vectors.config, state_of(vectors)
    width, height = vectors.events.width, vectors.events.height
    if config.is_plain:
        return _word(
            ("due", state.time, "time of the prediction, modulo 2^bits"),
            ("address", state.address, "row * width + column of the prediction"),
            ("p", 1, "polarity"),
        )
    stamp = state.ring_entry - state.address - 1 - state.support
    return _word(
        ("stamp", stamp, "tick of the event, modulo 2^bits"),
        ("x", (width - 1).bit_length(), "column of the event"),
        ("y", (height - 1).bit_length(), "row of the event"),
        ("p", 1, "polarity"),
        ("support", state.support, "min(carry, S)"),
    )


def cell_word(vectors: Vectors) -> Word:
    """Return the layout of a cell of the table."""
    config, state = vectors.config, state_of(vectors)
    if config.is_plain:
        return _word(
            ("due", state.time, "time of the prediction, modulo 2^bits"),
            ("p", 1, "polarity"),
            ("valid", 1, "0 = no cell"),
        )
    bins = [((side - 1) >> config.bin_bits) + 1 for side in (vectors.events.width, vectors.events.height)]
    low = (None, None) if config.set_bits is None else config.set_bits
    tags = [0 if bits is None else max((many - 1).bit_length() - bits, 0) for many, bits in zip(bins, low, strict=True)]
    fine = config.bin_bits + config.fraction_bits if config.lines else 0
    return _word(
        ("tag_y", tags[1], "row of the bin, without the low bits that name the set"),
        ("tag_x", tags[0], "column of the bin, without the low bits that name the set"),
        *((f"fine_{axis}", fine, "predicted place within the bin, fraction_bits below the px") for axis in _AXES),
        ("due", state.time, "tick of the last prediction, modulo 2^bits"),
        ("p", 1, "polarity"),
        ("uses", (config.uses - 1).bit_length() if config.uses else 0, "hits left, less 1"),
        ("support", state.support, "largest support carried here"),
        ("horizons", len(config.horizons_us), "a bit for each horizon, 0 = no cell"),
    )


def _word(*fields: tuple[str, int, str]) -> Word:
    """Return the word of the fields that are there at all."""
    return Word(tuple(Field(name=name, bits=bits, text=text) for name, bits, text in fields if bits))
