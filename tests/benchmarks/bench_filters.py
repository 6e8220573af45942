"""Measure the filters: pace, and what each removes by cause on the built-in scene with hot pixels and flicker.

    python tests/benchmarks/bench_filters.py [--events N] [--repeats R] [--no-shares]

Pace: the built-in disc and uniform events, each filter alone and all four in a row; best of R runs over the same
stream in chunks, fresh state each run, one thread. Shares: events removed by label, over 0.3 s from the start, so that
what a filter needs to find a hot pixel or a lamp is counted against it. The lamp lights a square of the disc by 100 Hz
while the rest of the light is steady; its events stand in the column of noise.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

import numpy as np

from tiegocancel import Events
from tiegocancel.events import EGO, MOVER, NOISE
from tiegocancel.filters import FilterChain, FilterConfig

WIDTH, HEIGHT = 1280, 720
CHUNK = 1 << 19  # as a run cuts its stream

SETTINGS: dict[str, dict[str, Any]] = {
    "hot pixel, 20 in 100 ms": {"hot_events": 20, "hot_window_us": 100_000},
    "flicker, 4 periods": {"flicker_periods": 4},
    "refractory, 1 ms": {"refractory_us": 1000},
    "refractory, 1 ms by polarity": {"refractory_us": 1000, "refractory_by_polarity": True},
    "background, 2 ms": {"background_us": 2000},
    "background, 2 ms, 2 of 8": {"background_us": 2000, "background_support": 2},
    "background, 2 ms, radius 2": {"background_us": 2000, "background_radius_px": 2},
    "background, 2 ms, radius 4": {"background_us": 2000, "background_radius_px": 4},
}
ALL: dict[str, Any] = {
    "hot_events": 20, "hot_window_us": 100_000, "flicker_periods": 4, "refractory_us": 1000, "background_us": 2000,
}  # fmt: skip


def scene(duration_s: float, *, sensor: dict[str, Any] | None = None, **settings: Any) -> Events:
    """Return the built-in disc scene with other settings."""
    from tiegocancel.scene import SceneConfig, SensorConfig, simulate

    config = SceneConfig(sensor=SensorConfig(**(sensor or {})), **settings)
    return Events.concatenate(list(simulate(config, duration_s=duration_s, seed=0)))


def lamp(duration_s: float) -> Events:
    """Return the disc with what a flickering light makes of a still square of 40 px on it."""
    from tiegocancel.scene import RigConfig

    disc, light = scene(duration_s), scene(duration_s, flicker_depth=0.3, rig=RigConfig(omega_rad_s=0.0))
    light = light.select((np.abs(light.x.astype(int) - 760) < 20) & (np.abs(light.y.astype(int) - 337) < 20))
    assert disc.label is not None
    t, x, y, p = (np.concatenate([getattr(disc, name), getattr(light, name)]) for name in "txyp")
    label = np.concatenate([disc.label, np.full(len(light), NOISE)])
    return Events.from_unsorted(t, x, y, p, WIDTH, HEIGHT, label)[0]


def uniform(count: int) -> Events:
    """Return events that have nothing in common, 4 Mev/s."""
    rng = np.random.default_rng(0)
    t = np.sort(rng.integers(0, count // 4, count))
    return Events(
        t, rng.integers(0, WIDTH, count), rng.integers(0, HEIGHT, count), rng.integers(0, 2, count), WIDTH, HEIGHT
    )


def pace(events: Events, settings: dict[str, Any], repeats: int) -> float:
    """Return Mev/s, the best of the runs."""
    best = float("inf")
    for _ in range(repeats):
        chain = FilterChain(FilterConfig(**settings), width=WIDTH, height=HEIGHT)
        chain.prepare()
        started = time.perf_counter()
        for first in range(0, len(events), CHUNK):
            chain.process(events[first : first + CHUNK])
        best = min(best, time.perf_counter() - started)
    return len(events) / best / 1e6


def removed(events: Events, settings: dict[str, Any]) -> list[float]:
    """Return the shares of ego, mover and noise events that the filters remove."""
    chain = FilterChain(FilterConfig(**settings), width=events.width, height=events.height)
    gone = ~np.concatenate([chain.process(events[first : first + CHUNK]) for first in range(0, len(events), CHUNK)])
    assert events.label is not None
    return [float(gone[events.label == label].mean()) for label in (EGO, MOVER, NOISE) if (events.label == label).any()]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--events", type=int, default=1_500_000)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--no-shares", dest="shares", action="store_false")
    args = parser.parse_args()
    streams = {"disc": scene(args.events / 3.7e6)[: args.events], "uniform": uniform(args.events)}
    sys.stdout.write(f"{'Mev/s':32}" + "".join(f"{name:>10}" for name in streams) + "\n")
    for name, settings in {**SETTINGS, "all four": ALL}.items():
        rates = [pace(events, settings, args.repeats) for events in streams.values()]
        sys.stdout.write(f"{name:32}" + "".join(f"{rate:10.1f}" for rate in rates) + "\n")
    if not args.shares:
        return
    scenes = {
        "disc": scene(0.3),
        "disc, noise 5 Hz": scene(0.3, sensor={"noise_hz": 5.0}),
        "disc, 500 hot pixels": scene(0.3, sensor={"hot_pixels": 500, "noise_hz": 0.0}),
        "disc with a lamp": lamp(0.3),
    }
    sys.stdout.write("\nremoved: ego / mover / noise\n" + " " * 32)
    sys.stdout.write("".join(f"{name:>24}" for name in scenes) + "\n")
    for name, settings in {**SETTINGS, "all four": ALL}.items():
        row = "".join(f"{' / '.join(f'{s:.3f}' for s in removed(events, settings)):>24}" for events in scenes.values())
        sys.stdout.write(f"{name:32}{row}\n")


if __name__ == "__main__":
    main()
