"""Write constants and vectors as C99 headers: fixed-width types, ``static const`` arrays, an include guard."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from tiegocancel.firmware_sim.export.constants import Constant
from tiegocancel.firmware_sim.export.vectors import Vectors

__all__ = ["CONFIG_HEADER", "VECTORS_HEADER", "config_header", "vectors_header"]

CONFIG_HEADER, VECTORS_HEADER = "tiegocancel_config.h", "tiegocancel_vectors.h"

_COLUMNS = 100


def config_header(parameters: Sequence[Constant]) -> str:
    """Return the header of the parameters: a ``#define`` for a number, an array for a list."""
    lines = []
    for one in parameters:
        if isinstance(one.value, int):
            value = f"INT64_C({one.value})" if one.signed else _literal(one.value)
            lines.append(f"#define {_macro(one.name)} ({value}) /* {one.text} */")
        else:
            lines += _array(one.name, one.value, (len(one.value),), one.text, signed_from=8 if one.signed else 0)
    return _guarded(CONFIG_HEADER, ["#include <stdint.h>", "", *lines])


def vectors_header(vectors: Vectors) -> str:
    """Return the header of events, decisions, schedule and, where a core was simulated, its cycles."""
    events, base_us = vectors.events, vectors.time_base_us
    count = len(events)
    schedules = vectors.schedules
    shape = (len(schedules), len(schedules[0]), 6)
    lines = [f"#define {_macro('events')} ({_literal(count)}) /* from an empty state on */"]

    lines += [
        f"#define {_macro(f'count_{name}')} ({_literal(count)}) /* counted at the end */"
        for name, count in dict(vectors.counters).items()
    ]

    def column(name: str, values: Iterable[int], text: str) -> list[str]:
        return _array(name, list(values), (count,), text)

    lines += column("event_t_us", (events.t - base_us).tolist(), "us after TIEGOCANCEL_TIME_BASE_US")
    lines += column("event_x", events.x.tolist(), "column, px")
    lines += column("event_y", events.y.tolist(), "row, px")
    lines += column("event_p", events.p.tolist(), "1 = ON, 0 = OFF")
    lines += column("suppressed", vectors.suppressed.tolist(), "1 = the event is not sent on")
    lines += column("support", vectors.support.tolist(), "S of the semantics, 0 without candidate")
    times = (schedules[0].t_us - base_us).tolist()
    lines += _array("schedule_t_us", times, (len(times),), "us after TIEGOCANCEL_TIME_BASE_US")
    flat = [value for one in schedules for row in one.coefficients.tolist() for value in row]
    lines += _array("schedule", flat, shape, "a to f of each horizon and entry", signed_from=32)
    if vectors.cycles is not None:
        cycles = vectors.cycles
        lines.append(
            f"#define {_macro('core_clock_hz')} ({_literal(round(cycles.clock_hz))}) /* of the simulated core */"
        )
        lines += column("core_dropped", cycles.dropped.tolist(), "1 = the input FIFO was full")
        lines += column("core_suppressed", cycles.suppressed.tolist(), "what the core decides, drops included")
        lines += column("core_arrival", cycles.arrival.tolist(), "cycle of the arrival")
        decided = [max(cycle, 0) for cycle in cycles.decided.tolist()]
        lines += column("core_decided", decided, "cycle of the decision, 0 where dropped")
    return _guarded(VECTORS_HEADER, ["#include <stdint.h>", f'#include "{CONFIG_HEADER}"', "", *lines])


def _guarded(name: str, body: list[str]) -> str:
    guard = name.upper().replace(".", "_")
    head = [f"/* {name}: written by tiegocancel export, see README.txt beside it. */", f"#ifndef {guard}"]
    return "\n".join([*head, f"#define {guard}", "", *body, "", f"#endif /* {guard} */"]) + "\n"


def _array(name: str, values: Sequence[int], shape: tuple[int, ...], text: str, *, signed_from: int = 0) -> list[str]:
    """Return the lines of an array in the narrowest type that holds every value, see :func:`_type`."""
    kind = _type(min(values), max(values), signed_from)
    sizes = "".join(f"[{_literal(size)}]" for size in shape)
    return [
        "",
        f"/* {text} */",
        f"static const {kind} tiegocancel_{name}{sizes} = {{",
        *_nested([_literal(int(value), signed=kind.startswith("i")) for value in values], shape, "    "),
        "};",
    ]


def _nested(values: list[str], shape: tuple[int, ...], indent: str) -> list[str]:
    """Return initialisers with the braces of every dimension but the outermost."""
    if len(shape) == 1:
        return _wrapped(values, indent)
    inner = len(values) // shape[0]
    lines = []
    for first in range(0, len(values), inner):
        part = _nested(values[first : first + inner], shape[1:], indent + "    ")
        lines += [f"{indent}{{", *part, f"{indent}}},"]
    lines[-1] = lines[-1].rstrip(",")
    return lines


def _wrapped(values: list[str], indent: str) -> list[str]:
    """Return values separated by commas, in lines of a readable width."""
    lines, line = [], indent
    for index, value in enumerate(values):
        word = value + ("," if index + 1 < len(values) else "")
        if len(line) + len(word) > _COLUMNS and line.strip():
            lines.append(line.rstrip())
            line = indent
        line += word + " "
    return [*lines, line.rstrip()]


def _type(least: int, most: int, signed_from: int) -> str:
    """Return the narrowest type of ``stdint.h``, with a sign and ``signed_from`` bits at least unless that is 0."""
    for bits in (8, 16, 32, 64):
        if least >= 0 and not signed_from and most < 1 << bits:
            return f"uint{bits}_t"
        if (least < 0 or bits >= signed_from > 0) and -(1 << (bits - 1)) < least and most < 1 << (bits - 1):
            return f"int{bits}_t"
    raise ValueError(f"{least} to {most} fit no integer of 64 bits")


def _literal(value: int, *, signed: bool = False) -> str:
    """Return a constant: unsigned ones carry the suffix U, which C99 widens as far as the value needs."""
    return str(int(value)) if signed or value < 0 else f"{int(value)}U"


def _macro(name: str) -> str:
    return f"TIEGOCANCEL_{name.upper()}"
