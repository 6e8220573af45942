"""Measure the motion estimators on one thread, beside eventcv's contrast maximisation on the same windows.

    python tests/benchmarks/bench_motion.py [--windows N] [--omega RAD_S] [--skip-eventcv]

Times are CPU time of this process; kernels are compiled before. Four tables:

1. RotationTracker, 100 updates/s, a chunk an update; what follows acquisition, which has its own column.
2. Windows of 20 ms of the built-in disc. Every method sees the same events of each window, one after the other; medians
   over windows. *near*: the start is 3 % in ω and 3 px along both axes from the truth, what a tracker knows; *rest*:
   no motion. A window counts as found within 1 % of ω. eventcv has two models, of which ``rotation`` warps to
   first order, linear in the pixel: with the camera's principal point in the middle of the events and a focal length of
   their spread it has just the three unknowns of a rotation about an unknown centre, in units that fit its simplex.
   Its step is 1 rad/s from rest, as its manual has it, and 0.1 rad/s near. Rows without blur and on a sensor cropped
   to the disc are its fastest settings. Its stream is built before the clock starts; our window within it.
3. fit_rotation on whole recordings, from nothing.
4. CircleEstimator on a real spinning dot (``../shared/data``, left out where absent), and fusion, a row.
"""

from __future__ import annotations

import argparse
import functools
import math
import os
import platform
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tiegocancel import Events
from tiegocancel.estimation.contrast.ascent import ascend
from tiegocancel.estimation.contrast.fit import fit_rotation
from tiegocancel.estimation.contrast.scorer import Twist
from tiegocancel.estimation.contrast.thinning import thinned
from tiegocancel.estimation.contrast.track import RotationTracker, TrackConfig
from tiegocancel.estimation.contrast.window import Scratch, Window
from tiegocancel.scene import SceneConfig, simulate

CENTER = (664.6, 336.9)
WINDOW_US, BETWEEN_US = 20_000, 30_000
FEW = 19_999  # from 20,000 events on eventcv copies its image for each thread
STEP_US = 10_000
SIDE = 580  # of the sensor cropped to the disc
FOUND = 0.01  # nearer than any start
DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
THREADS = ("OMP_NUM_THREADS", "TIEGOCANCEL_THREADS", "RAYON_NUM_THREADS")

Motion = tuple[tuple[float, float], float]
"""Centre in px and ω in rad/s."""
Method = Callable[[Events], tuple[float, Motion]]
"""Estimate the motion of a window; return CPU seconds and what was found."""


def stay_on_one_thread() -> None:
    """Start again with libraries told to use one thread: they read that when they are loaded."""
    if any(os.environ.get(name) != "1" for name in THREADS):
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | dict.fromkeys(THREADS, "1"))


@functools.cache
def disc(duration_s: float, *, width: int = 1280, height: int = 720, omega_rad_s: float = 3.6) -> Events:
    """Return the built-in scene."""
    config = SceneConfig.disc(width=width, height=height, omega_rad_s=omega_rad_s)
    return Events.concatenate(list(simulate(config, duration_s=duration_s, seed=0)))


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Write a table in Markdown, each row as soon as it is there."""
    sys.stdout.write(f"\n**{title}**\n\n| {' | '.join(columns)} |\n|{'---|' * len(columns)}\n")
    for row in rows:
        sys.stdout.write(f"| {' | '.join(row)} |\n")
        sys.stdout.flush()


def errors(found: Motion, truth: Motion) -> tuple[float, float]:
    """Return the error of ω as a share of it, and that of the centre in px."""
    return abs(found[1] / truth[1] - 1.0), math.dist(found[0], truth[0])


# 1. Online


def online(name: str, events: Events, truth: Motion, config: TrackConfig) -> list[str]:
    """Feed a tracker a chunk an update; return the row of the table."""
    tracker = RotationTracker(config, width=events.width, height=events.height)
    first_us, step_us = int(events.t[0]), config.step_us
    seconds, rows, begun = [], [], 0
    for start_us in range(first_us, int(events.t[-1]), step_us):
        chunk = events.between(start_us, start_us + step_us)
        started = time.process_time()
        found = tracker.process(chunk)
        seconds.append(time.process_time() - started)
        if begun:
            rows += found
        elif any(row.confident for row in found):
            begun = len(seconds)
    if not rows:
        return [name, f"{len(events) / events.span_us:.2f}", "none was found", *["–"] * 8]
    later = np.array(seconds[begun:])
    sure = [row for row in rows if row.confident]
    omega, center = np.array([errors((row.center_px, row.omega_rad_s), truth) for row in sure]).T
    used, seen = (int(np.median([getattr(row, each) for row in sure])) for each in ("events_used", "events_seen"))
    return [
        name,
        f"{len(events) / events.span_us:.2f}",
        f"{1e6 / step_us:.0f}",
        f"{len(sure)} of {len(rows)}",
        f"{used:,} of {seen:,}",
        f"{1e3 * np.median(later):.1f}",
        f"{1e3 * later.max():.1f}",
        f"{later.mean() / (step_us * 1e-6):.0%}",
        f"{sum(seconds[:begun]):.2f}",
        f"{np.median(omega):.3%}",
        f"{np.median(center):.2f}",
    ]


def online_rows(seconds: float) -> Iterator[list[str]]:
    """Run the tracker on streams of 1, 3.7 and 10 Mev/s."""
    config = TrackConfig(step_us=STEP_US)
    full = disc(seconds)
    one = thinned(full, round(seconds * 1e6), np.random.default_rng(0))
    online("", full.between(0, 60_000), (CENTER, 3.6), config)  # compile
    yield online("disc, events drawn at random", one, (CENTER, 3.6), config)
    smaller = disc(seconds, width=800, height=450)
    place = (CENTER[0] * 800 / 1280, CENTER[1] * 450 / 720)
    yield online("disc on 800 × 450 px", smaller, (place, 3.6), config)
    yield online("disc", full, (CENTER, 3.6), config)
    yield online("disc, 10 rad/s", disc(0.5 * seconds, omega_rad_s=10.0), (CENTER, 10.0), config)
    if (DATA / "anu_disc_10ms.npy").exists():
        # So short that the windows still grow and the first estimates still weigh: what it shows is the cost.
        yield online("real disc, its first 10 ms", real_disc(), (CENTER, 3.63), TrackConfig(step_us=1_000))


def real_disc() -> Events:
    """Return the real events of ten milliseconds of a spinning disc."""
    columns = np.load(DATA / "anu_disc_10ms.npy").astype(np.float64)
    x, y, p, t_s, _ = columns[columns[:, 4] == 0.0].T  # the rest was predicted
    t = np.rint(t_s * 1e6).astype(np.int64)
    order = np.argsort(t, kind="stable")
    return Events(*(each[order].astype(np.int64) for each in (t, x, y, p)), 1280, 720)


# 2. Windows


def climb(cells_px: tuple[float, ...], start: Motion) -> Method:
    """Return our climb from a start."""
    scratch = Scratch()

    def method(events: Events) -> tuple[float, Motion]:
        started = time.process_time()
        middle = (float(events.x.mean()), float(events.y.mean()))
        window = Window(
            events, start_us=int(events.t[0]), stop_us=int(events.t[-1]) + 1, anchor_px=middle, scratch=scratch
        )
        twist = ascend(window, Twist.about(*start, middle), cells_px=cells_px).twist
        seconds = time.process_time() - started
        return seconds, (twist.center_px(middle), twist.omega_rad_s)

    return method


def whole_search(events: Events) -> tuple[float, Motion]:
    """Find the motion of a window with no start but |ω| ≤ 200 rad/s."""
    started = time.process_time()
    fit = fit_rotation(events)
    return time.process_time() - started, (fit.center_px, fit.omega_rad_s)


def eventcv(start: Motion | None, *, blur_px: float | None = None, cropped: bool = False) -> Method:
    """Return eventcv's contrast maximisation of variance, from rest without a ``start``."""
    import eventcv as library

    def method(events: Events) -> tuple[float, Motion]:
        left = np.array([round(CENTER[0]) - SIDE // 2, round(CENTER[1]) - SIDE // 2]) if cropped else np.zeros(2, int)
        size = (SIDE, SIDE) if cropped else (events.width, events.height)
        place = np.column_stack([events.x, events.y]).astype(np.int64) - left
        held = ((place >= 0) & (place < size)).all(axis=1)
        columns = np.column_stack([place, events.t, events.p])[held].astype(np.int64)
        stream = library.from_numpy(columns, sensor_size=size, time_unit="us")
        middle = columns[:, :2].mean(axis=0)
        focal = float(np.sqrt(np.mean(np.sum((columns[:, :2] - middle) ** 2, axis=1))))
        camera = library.Camera(focal, focal, *middle.tolist())
        # Its x' = x − ωz·t·y + f·ωy·t undoes a turn by −ωz and a drift (−f·ωy, f·ωx).
        initial = None
        if start is not None:
            vx, vy, omega = Twist.about(start[0], start[1], (float(middle[0] + left[0]), float(middle[1] + left[1])))
            initial = [vy / focal, -vx / focal, -omega]
        started = time.process_time()
        result = stream.contrast_maximise(
            model="rotation",
            camera=camera,
            blur_sigma=blur_px,
            initial=initial,
            initial_step=1.0 if start is None else 0.1,
        )
        seconds = time.process_time() - started
        omega_x, omega_y, omega_z = result["params"]
        if omega_z == 0.0:
            return seconds, ((math.inf, math.inf), 0.0)
        twist = Twist(-omega_y * focal, omega_x * focal, -omega_z)
        x, y = twist.center_px((float(middle[0]), float(middle[1])))
        return seconds, ((x + float(left[0]), y + float(left[1])), -omega_z)

    return method


def window_rows(count: int, truth: Motion, *, beside: bool) -> Iterator[list[str]]:
    """Compare the methods on the same windows."""
    omega = truth[1]
    events = disc((count * BETWEEN_US + WINDOW_US) * 1e-6, omega_rad_s=omega)
    cuts = [events.between(k * BETWEEN_US, k * BETWEEN_US + WINDOW_US) for k in range(1, count + 1)]
    near = ((CENTER[0] + 3.0, CENTER[1] + 3.0), 1.03 * omega)
    still = (CENTER, 0.0)
    methods: dict[str, dict[str, Method]] = {
        "near": {
            "ours, cells of 2 px": climb((2.0,), near),
            "ours, cells of 1 px": climb((1.0,), near),
        },
        "rest": {
            "ours, cells of 8, 4, 2 px": climb((8.0, 4.0, 2.0), still),
            "ours, search of ±200 rad/s": whole_search,
        },
    }
    if beside:
        for name, start in (("near", near), ("rest", None)):
            methods[name] |= {
                "eventcv": eventcv(start),
                "eventcv, no blur": eventcv(start, blur_px=0.0),
                "eventcv, no blur, cropped": eventcv(start, blur_px=0.0, cropped=True),
            }
    for most in (FEW, len(events)):
        parts = [thinned(cut, most, np.random.default_rng(k)) for k, cut in enumerate(cuts)]
        size = int(np.median([len(part) for part in parts]))
        for start_name, named in methods.items():
            for method in named.values():
                method(parts[0])  # compile, map memory
            results: dict[str, list[tuple[float, Motion]]] = {name: [] for name in named}
            for part in parts:
                for name, method in named.items():
                    results[name].append(method(part))
            first = np.median([taken for taken, _ in next(iter(results.values()))])
            for name, result in results.items():
                off = np.array([errors(found, truth) for _, found in result])
                taken = float(np.median([each for each, _ in result]))
                yield [
                    f"{size:,}", start_name, name, f"{1e3 * taken:,.1f}", f"{taken / first:.1f}", *_quality(off)
                ]  # fmt: skip


def _quality(off: NDArray[np.float64]) -> list[str]:
    """Return the cells for errors [n, 2]; medians and worst are over the windows that were found."""
    good = off[off[:, 0] < FOUND]
    cells = [f"{len(good)} of {len(off)}"]
    if not len(good):
        return [*cells, *["–"] * 4]
    middle, worst = np.median(good, axis=0), good.max(axis=0)
    return [*cells, f"{middle[0]:.3%}", f"{worst[0]:.2%}", f"{middle[1]:.2f}", f"{worst[1]:.2f}"]


# 3. Whole recordings


def fit_rows(seconds: float, omega_rad_s: float, repeats: int = 3) -> Iterator[list[str]]:
    """Fit whole recordings from nothing."""
    for part_s in (0.1, seconds):
        events = disc(seconds, omega_rad_s=omega_rad_s).between(0, round(part_s * 1e6))
        taken = []
        for _ in range(repeats):
            started = time.process_time()
            fit = fit_rotation(events)
            taken.append(time.process_time() - started)
        omega, center = errors((fit.center_px, fit.omega_rad_s), (CENTER, omega_rad_s))
        yield [
            f"{part_s:g}", f"{len(events):,}", f"{fit.events_used:,}", f"{np.median(taken):.2f}", f"{omega:.3%}",
            f"{center:.2f}",
        ]  # fmt: skip


# 4. The rest


def other_rows() -> Iterator[list[str]]:
    """Time the circle estimator and the fusions."""
    dot = DATA / "spinning_dot_evt2.raw"
    if dot.exists():
        from tiegocancel import read_events
        from tiegocancel.estimation.circle.estimator import CircleEstimator

        events = read_events(dot)
        seconds, rows = [], []
        estimator = CircleEstimator(width=events.width, height=events.height)
        step_us = estimator.config.step_us
        for start_us in range(int(events.t[0]), int(events.t[-1]), step_us):
            chunk = events.between(start_us, start_us + step_us)
            started = time.process_time()
            found = estimator.process(chunk)
            if found:  # before the first whole window there is nothing to do
                seconds.append(time.process_time() - started)
            rows += found
        sure = sum(row.confident for row in rows)
        what = f"CircleEstimator, {len(events) / events.span_us:.1f} Mev/s, {sure} of {len(rows)} rows confident"
        yield [what, f"{1e6 * np.median(seconds):,.0f}", f"{len(seconds)}"]
    from tiegocancel.estimation.estimate import MotionEstimate
    from tiegocancel.estimation.inertial.fusion import ExponentialFusion, Fusion, KalmanFusion, fuse

    rng = np.random.default_rng(0)
    t_us = np.arange(1, 2_001) * 1_000
    gyro = 3.6 + rng.normal(0.0, 0.01, len(t_us))
    seen = [
        MotionEstimate(
            t_us=int(t), center_px=CENTER, center_sigma_px=0.2, omega_rad_s=3.6 + 0.005 * rng.normal(),
            omega_sigma_rad_s=0.005,
        )
        for t in t_us[9::10]
    ]  # fmt: skip
    fusions: dict[str, Callable[[], Fusion]] = {"ExponentialFusion": ExponentialFusion, "KalmanFusion": KalmanFusion}
    for name, make in fusions.items():
        taken = []
        for _ in range(11):
            started = time.process_time()
            count = len(fuse(make(), seen, t_us, gyro))
            taken.append((time.process_time() - started) / count)
        yield [f"{name}, gyroscope at 1 kHz and events at 100 Hz", f"{1e6 * np.median(taken):.1f}", "11 × 2,000"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--windows", type=int, default=12)
    parser.add_argument("--omega", type=float, default=3.6, help="of the disc in tables 2 and 3, rad/s")
    parser.add_argument("--skip-eventcv", action="store_true")
    args = parser.parse_args()
    stay_on_one_thread()
    beside = not args.skip_eventcv and find_spec("eventcv") is not None
    names = ["tiegocancel", "taichi", "numpy", "scipy", *["eventcv"] * beside]
    versions = ", ".join(f"{name} {version(name)}" for name in names)
    sys.stdout.write(f"Python {platform.python_version()}, {versions}; one thread, CPU time.\n")
    error_columns = ("ω error", "centre error (px)")
    table(
        "1. RotationTracker",
        (
            "stream", "Mev/s", "updates/s", "confident", "events used of a window", "ms an update", "worst (ms)",
            "of one core", "acquisition (s)", *error_columns,
        ),
        online_rows(1.0),
    )  # fmt: skip
    table(
        f"2. The same windows of 20 ms, {args.windows} of them, ω = {args.omega:g} rad/s",
        (
            "events", "start", "method", "ms a window", "times ours", "found", "ω error", "worst", "centre error (px)",
            "worst",
        ),
        window_rows(args.windows, (CENTER, args.omega), beside=beside),
    )  # fmt: skip
    table(
        "3. fit_rotation",
        ("recording (s)", "events", "used", "seconds", *error_columns),
        fit_rows(1.0, args.omega),
    )
    table("4. Circle and fusion", ("what", "µs a row", "rows"), other_rows())


if __name__ == "__main__":
    main()
