"""Write the text that explains a folder of vectors to who finds it. ASCII."""

from __future__ import annotations

from tiegocancel.firmware_sim.export.layout import CYCLES, DECISIONS, EVENTS, SCHEDULE, cell_word, ring_word
from tiegocancel.firmware_sim.export.vectors import Vectors
from tiegocancel.firmware_sim.export.words import Word

from tiegocancel.motion.schedule import MotionSchedule

__all__ = ["readme_text"]

_TITLES = {
    EVENTS: "input packets, one an event, in the order in which they come",
    DECISIONS: "the decision on each of them",
    SCHEDULE: "the motion: entries of the shortest horizon first, then those of the next",
    CYCLES: "what the simulated core does at its clock",
}


def readme_text(vectors: Vectors, words: dict[str, Word]) -> str:
    """Return the text of ``README.txt``."""
    events, config = vectors.events, vectors.config
    lines = [
        "Golden vectors of tiegocancel",
        "",
        f"{len(events)} events of a sensor of {events.width} x {events.height} px in {events.span_us} us, "
        f"{int(vectors.suppressed.sum())} of them suppressed. The rule is defined in",
        "tiegocancel/matching/semantics.md; a device that computes it gives these decisions, bit for bit.",
        "",
        "Start from an empty state: no ring entry, no cell. The first event of events.memh is the first that the",
        "device sees, and nothing can be suppressed before the shortest horizon, less its early gate, has passed.",
        "",
        f"Times count from the time base, {vectors.time_base_us} us of the recording: a whole tick, so that",
        f"(t_us >> {config.tick_bits}) is the tick. Several events may share one time; the file's order decides.",
        "An event uses the last schedule entry with t_us at or before its own, the first one before that:",
        "  x' = ((x << 16) + a*x + b*y + c + 32768) >> 16     (arithmetic shift)",
        "  y' = ((y << 16) + d*x + e*y + f + 32768) >> 16",
        *_remark_on_unknown(vectors),
        "",
        "Counted at the end: " + ", ".join(f"{name} {count}" for name, count in dict(vectors.counters).items()) + ".",
        "",
        "Words, highest bits first. $readmemh reads the files as they are, with reg [bits-1:0] m [0:words-1]:",
    ]
    for name, word in words.items():
        count = len(vectors.schedules) * len(vectors.schedules[0]) if name == SCHEDULE else len(events)
        lines += ["", f"{name}: {count} words of {word.bits} bits, {_TITLES[name]}", *_indented(word)]
    lines += [
        "",
        "State of a device at the least widths (constants ring_entry_... and cell_..., low bits last):",
        "",
        f"a ring entry, {ring_word(vectors).bits} bits",
        *_indented(ring_word(vectors)),
        "",
        f"a cell, {cell_word(vectors).bits} bits",
        *_indented(cell_word(vectors)),
        "",
        "config.json            every parameter in ticks, bits and squared px, the layouts above, and the",
        "                       configuration as it was given (cancel)",
        "tiegocancel_config.h   the same parameters for C99",
        "tiegocancel_config.vh  the same for Verilog; element i of a list is NAME[i*NAME_BITS +: NAME_BITS]",
        "tiegocancel_vectors.h  events, decisions and schedule as static const arrays",
        "vectors.json           the same numbers once more, the command, and the SHA-256 of every file",
    ]
    if vectors.cycles is not None:
        lines += [
            "",
            f"{CYCLES} is of one core at {vectors.cycles.clock_hz:g} Hz (config.json, core). Its input FIFO drops",
            "what it cannot take; what was dropped is not predicted from either, so later decisions can differ from",
            f"{DECISIONS}. {int(vectors.cycles.dropped.sum())} events were dropped.",
        ]
    return "\n".join(lines) + "\n"


def _remark_on_unknown(vectors: Vectors) -> list[str]:
    """Say what an entry of an unknown motion is, where there is one: its coefficients ask for many bits."""
    unknown = MotionSchedule.unknown().coefficients[0]
    if not any((one.coefficients == unknown).all(axis=1).any() for one in vectors.schedules):
        return []
    return ["An entry with c = f = 2^44 marks a motion that is not known: it predicts beyond every sensor."]


def _indented(word: Word) -> list[str]:
    return [f"  {line}" for line in word.lines()]
