"""The C headers compile without a warning, and a plain program decides from them as the vectors say."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.export import Vectors, core_cycles, golden_vectors, write_vectors

from tiegocancel.matching.config import CancelConfig

STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wundef", "-Werror"]
PROGRAM = Path(__file__).with_name("plain_rule.c")


@pytest.fixture(scope="module")
def compiler() -> str:
    found = shutil.which("cc")
    if found is None:
        pytest.skip("no C compiler (cc) is here")
    return found


def ran(compiler: str, folder: Path, source: Path) -> list[int]:
    """Compile a program against the headers of a folder and return the numbers that it prints."""
    program = folder / "program"
    done = subprocess.run(
        [compiler, *STRICT, "-I", str(folder), str(source), "-o", str(program)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    told = subprocess.run([str(program)], capture_output=True, text=True, check=True)
    return [int(word) for word in told.stdout.split()]


def sums_of(folder: Path) -> tuple[str, int]:
    """Return a program that prints the sum of every array and the value of every macro, and how many there are."""
    text = (folder / "tiegocancel_config.h").read_text() + (folder / "tiegocancel_vectors.h").read_text()
    arrays = re.findall(r"static const \w+ (\w+)((?:\[\w+\])+)", text)
    macros = re.findall(r"#define (\w+) \(", text)
    lines = ["#include <stdio.h>", '#include "tiegocancel_vectors.h"', "int main(void)", "{"]
    for name, sizes in arrays:
        first = f"&{name}{'[0]' * sizes.count('[')}"
        lines += [
            "    {",
            "        long long sum = 0;",
            f"        for (size_t i = 0; i < sizeof {name} / sizeof *({first}); i++) {{",
            f"            sum += (long long)({first})[i];",
            "        }",
            '        printf("%lld\\n", sum);',
            "    }",
        ]
    lines += [f'    printf("%lld\\n", (long long){name});' for name in macros]
    return "\n".join([*lines, "    return 0;", "}"]) + "\n", len(arrays) + len(macros)


def expected_sums(vectors: Vectors) -> dict[str, int]:
    """Return what the sums of the vectors' arrays must be."""
    events, base_us = vectors.events, vectors.time_base_us
    sums = {
        "event_t_us": int((events.t - base_us).sum()),
        "event_x": int(events.x.sum()),
        "event_y": int(events.y.sum()),
        "event_p": int(events.p.sum()),
        "suppressed": int(vectors.suppressed.sum()),
        "support": int(vectors.support.sum()),
        "schedule_t_us": int((vectors.schedules[0].t_us - base_us).sum()),
        "schedule": sum(int(one.coefficients.sum()) for one in vectors.schedules),
        "window_dx": sum(dx for dx, _ in vectors.config.offsets),
        "window_least_shift_squared_px": sum(vectors.config.spread_shifts_squared),
        "ring_capacity": sum(vectors.config.ring_capacities),
    }
    if vectors.cycles is not None:
        sums["core_arrival"] = int(vectors.cycles.arrival.sum())
        sums["core_decided"] = int(vectors.cycles.decided[~vectors.cycles.dropped].sum())
        sums["core_dropped"] = int(vectors.cycles.dropped.sum())
    return sums


def assert_headers_hold_the_vectors(compiler: str, folder: Path, vectors: Vectors) -> None:
    write_vectors(folder, vectors, command=[])
    program, count = sums_of(folder)
    (folder / "sums.c").write_text(program)
    numbers = ran(compiler, folder, folder / "sums.c")
    assert len(numbers) == count
    text = (folder / "tiegocancel_config.h").read_text() + (folder / "tiegocancel_vectors.h").read_text()
    names = re.findall(r"static const \w+ tiegocancel_(\w+)\[", text) + re.findall(
        r"#define TIEGOCANCEL_(\w+) \(", text
    )
    told = dict(zip(names, numbers, strict=True))
    expected = expected_sums(vectors)
    assert {name: told[name] for name in expected} == expected
    assert (told["TIME_BASE_US"], told["WIDTH"]) == (vectors.time_base_us, vectors.events.width)
    assert told["EVENTS"] == len(vectors.events)
    assert told["COUNT_PREDICTED"] == vectors.counters.predicted


@pytest.mark.parametrize("seed", range(8))
def test_headers_of_random_vectors_compile_and_hold_every_number(
    draw: Callable[[int], Any], compiler: str, tmp_path: Path, seed: int
) -> None:
    config, events, schedules = draw(seed)
    assert_headers_hold_the_vectors(compiler, tmp_path, golden_vectors(events, config, schedules))


def test_headers_hold_the_cycles_too(disc: Callable[..., Vectors], compiler: str, tmp_path: Path) -> None:
    from dataclasses import replace

    vectors = disc(CancelConfig(horizon_us=2000, ring_capacity=500))
    cycles = core_cycles(vectors, CoreConfig(input_depth=2), clock_hz=2e6)
    assert_headers_hold_the_vectors(compiler, tmp_path, replace(vectors, cycles=cycles))


@pytest.mark.parametrize("polarity", ["opposite", "equal", "ignore"])
def test_firmware_made_of_the_headers_decides_as_the_vectors_say(
    disc: Callable[..., Vectors], compiler: str, tmp_path: Path, polarity: str
) -> None:
    vectors = disc(CancelConfig(horizon_us=2000, polarity=polarity, ring_capacity=60), start_us=-7001)
    write_vectors(tmp_path, vectors, command=[])
    wrong, suppressed, *sums = ran(compiler, tmp_path, PROGRAM)
    assert (wrong, suppressed) == (0, int(vectors.suppressed.sum()))
    expected = expected_sums(vectors)
    assert sums == [expected[name] for name in ("event_t_us", "event_x", "event_y", "event_p", "support")]
