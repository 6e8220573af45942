"""Measure Canceller.process beside the same rule in plain C (-O3, one thread), in one run, as a ratio.

    python tests/benchmarks/bench_canceller.py [--events N] [--repeats R]

Streams: the built-in disc scene, edges (lines of a turning pattern, no noise) and uniform events; each with and
without ``source``. The C code is ``packed.c``, compiled here, called for the same chunks, each with fresh arrays for
its answers as ``process`` has them. Times are the best of R runs taken in turn, because machines are noisy; decisions
must be equal or the run stops.
"""

from __future__ import annotations

import argparse
import ctypes
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tiegocancel import CancelConfig, Canceller, Events, MotionSchedule

WIDTH, HEIGHT = 1280, 720
CENTER, OMEGA = (664.6, 336.9), 3.6
CHUNK = 1 << 19  # as a run cuts its stream


def disc(count: int) -> Events:
    """Return ``count`` events of the built-in scene."""
    from tiegocancel.scene import SceneConfig, simulate

    parts: list[Events] = []
    for chunk in simulate(SceneConfig(), duration_s=10.0, seed=0):
        parts.append(chunk)
        if sum(map(len, parts)) >= count:
            break
    return Events.concatenate(parts)[:count]


def edges(count: int) -> Events:
    """Return events of 60 curved lines that turn, 4 Mev/s."""
    rng = np.random.default_rng(0)
    t = np.sort(rng.integers(0, count // 4, count))
    line, radius = rng.integers(0, 60, count), 264 * np.sqrt(rng.random(count))
    angle = line * (2 * np.pi / 60) + 0.3 * np.sin(radius / 20) + OMEGA * t * 1e-6
    x = np.rint(CENTER[0] + radius * np.cos(angle)).astype(np.int64)
    y = np.rint(CENTER[1] + radius * np.sin(angle)).astype(np.int64)
    return Events(t, x, y, line & 1, WIDTH, HEIGHT)


def uniform(count: int) -> Events:
    """Return events that have nothing in common, 4 Mev/s."""
    rng = np.random.default_rng(0)
    t = np.sort(rng.integers(0, count // 4, count))
    return Events(
        t, rng.integers(0, WIDTH, count), rng.integers(0, HEIGHT, count), rng.integers(0, 2, count), WIDTH, HEIGHT
    )


def build_c(folder: Path, offsets: list[int] | None) -> ctypes.CDLL:
    """Compile packed.c with -O3 for this machine; ``offsets`` are compiled in, as they are in the kernel."""
    library = folder / ("packed.so" if offsets is None else "unrolled.so")
    source = Path(__file__).with_name("packed.c")
    window = [] if offsets is None else ["-DWINDOW=" + " ".join(f"LOOK({offset})" for offset in offsets)]
    command = ["cc", "-O3", "-march=native", "-shared", "-fPIC", *window, "-o", str(library), str(source)]
    subprocess.run(command, check=True, cwd=folder)
    return ctypes.CDLL(str(library))


def pointer(array: NDArray[np.generic]) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


def run_c(
    library: ctypes.CDLL, events: Events, config: CancelConfig, motion: MotionSchedule, track: bool
) -> tuple[float, NDArray[np.bool_]]:
    """Time the C code over the stream; state is laid out by a Canceller, so both work on the same arrays."""
    state = Canceller(config, motion, width=WIDTH, height=HEIGHT, track_source=track)._arguments
    totals = np.zeros(7, np.int64)
    coefficients = np.array(motion.coefficients)
    parts = []
    base = int(events.t[0]) - config.tolerance_us
    started = time.perf_counter()
    for first in range(0, len(events), CHUNK):
        part = events[first : first + CHUNK]
        suppressed = np.zeros(len(part), np.uint8)
        source = np.full(len(part) if track else 1, -1, np.int64)
        library.cancel(
            ctypes.c_int64(len(part)), pointer(part.t), pointer(part.x), pointer(part.y), pointer(part.p),
            ctypes.c_int64(base), ctypes.c_uint32(config.horizon_us), ctypes.c_uint32(config.tolerance_us),
            WIDTH, HEIGHT, state["stride"], state["origin"], state["capacity"], pointer(state["offsets"]),
            len(state["offsets"]), pointer(coefficients), pointer(state["cells"]),
            pointer(state["cell_source"]) if track else None, pointer(state["ring"]),
            pointer(state["ring_source"]) if track else None, pointer(totals), pointer(suppressed),
            pointer(source) if track else None, ctypes.c_int64(first),
        )  # fmt: skip
        parts.append(suppressed.view(np.bool_))
    seconds = time.perf_counter() - started
    return seconds, np.concatenate(parts)


def run_kernel(
    events: Events, config: CancelConfig, motion: MotionSchedule, track: bool
) -> tuple[float, NDArray[np.bool_]]:
    """Time Canceller.process over the stream."""
    canceller = Canceller(config, motion, width=WIDTH, height=HEIGHT, track_source=track)
    parts = []
    started = time.perf_counter()
    for first in range(0, len(events), CHUNK):
        parts.append(canceller.process(events[first : first + CHUNK]).suppressed)
    seconds = time.perf_counter() - started
    return seconds, np.concatenate(parts)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--events", type=int, default=3_000_000)
    parser.add_argument("--repeats", type=int, default=7)
    args = parser.parse_args()
    config = CancelConfig()
    motion = MotionSchedule.rotation(center_px=CENTER, omega_rad_s=OMEGA, horizon_us=config.horizon_us)
    sys.stdout.write(f"{'':17}{'':>8}{'Mev/s':>10}{'':24}{'ratio of ours to':>20}\n")
    names = ("C, loop", "C, unrolled", "ours", "loop", "unrolled")
    sys.stdout.write(f"{'stream':9}{'source':>8}{'CR':>8}" + "".join(f"{name:>12}" for name in names) + "\n")
    offsets = Canceller(config, motion, width=WIDTH, height=HEIGHT)._arguments["offsets"].tolist()
    with tempfile.TemporaryDirectory() as folder:
        libraries = [build_c(Path(folder), None), build_c(Path(folder), offsets)]
        for name, make in (("disc", disc), ("edges", edges), ("uniform", uniform)):
            events = make(args.events)
            for track in (False, True):
                run_kernel(events[:10], config, motion, track)  # compile
                seconds: list[list[float]] = [[], [], []]
                for _ in range(args.repeats):
                    taken, found = run_kernel(events, config, motion, track)
                    seconds[2].append(taken)
                    for library, times in zip(libraries, seconds[:2], strict=True):
                        taken, wanted = run_c(library, events, config, motion, track)
                        times.append(taken)
                        if not np.array_equal(wanted, found):
                            raise SystemExit(f"{name}: the kernel and the C code disagree")
                rates = [len(events) / min(times) / 1e6 for times in seconds]
                row = f"{name:9}{'yes' if track else 'no':>8}{found.mean():8.1%}"
                row += "".join(f"{rate:12.1f}" for rate in rates)
                sys.stdout.write(row + "".join(f"{rates[2] / rate:12.2f}" for rate in rates[:2]) + "\n")


if __name__ == "__main__":
    main()
