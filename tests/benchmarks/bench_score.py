"""Measure what a score of residuals would add to support: how well each tells ego from mover among matched events.

    python tests/benchmarks/bench_score.py [--scenes NAME ...]

The preset ``selective`` without need, so that every event with a candidate is matched and its support known. For each
match: support, delay, distance in whole px and below the pixel, and the residual along and across the line on which the
prediction moves. A logistic score of them is fitted on the earlier half of the matches and judged on the later half by
the best J of any threshold, events without a match included.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tiegocancel import CancelConfig, Canceller, Events
from tiegocancel.events import EGO, MOVER
from tiegocancel.matching.presets import PRESETS
from tiegocancel.motion.schedule import FRACTION_BITS
from tiegocancel.scene import scene_named, simulate, true_motion

SKIPPED_US, DURATION_S = 80_000, 0.25
Floats = NDArray[np.float64]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", default=["disc", "noisy", "camera", "two-movers"])
    rows: list[list[str]] = []
    for scene in parser.parse_args().scenes:
        scores, ego, later, totals = _matched(scene)
        fields = [scene]
        for name, columns in scores.items():
            score = columns[:, 0] if name == "support" else _logistic(columns, ego, later)
            fields.append("{:.4f} ({:.3f}, {:.3f})".format(*_best(score[later], ego[later], *totals)))
        if not rows:
            rows.append(["scene", *scores])
            sys.stdout.write(f"| {' | '.join(rows[0])} |\n|{'---|' * len(rows[0])}\n")
        sys.stdout.write(f"| {' | '.join(fields)} |\n")
        sys.stdout.flush()


def _matched(name: str) -> tuple[dict[str, Floats], NDArray[np.bool_], NDArray[np.bool_], tuple[int, int]]:
    """Return what each score sees of every match, which are ego's, which are later, and the later ego and mover."""
    scene = scene_named(name)
    events = Events.concatenate(list(simulate(scene, duration_s=DURATION_S, seed=1)))
    table = {key: tuple(value) if isinstance(value, list) else value for key, value in PRESETS["selective"].items()}
    config = replace(CancelConfig(**table), need=1, ring_capacity=1 << 18)
    schedule = true_motion(scene, duration_s=DURATION_S).schedule(config.horizon_us)
    decisions = Canceller(config, schedule, width=events.width, height=events.height).process(events)
    assert events.label is not None
    assert decisions.source is not None
    assert decisions.support is not None
    counted = (events.t >= int(events.t[0]) + SKIPPED_US) & np.isin(events.label, (EGO, MOVER))
    met = np.flatnonzero(counted & decisions.suppressed)
    made = decisions.source[met]
    x, y = events.x[made].astype(np.float64), events.y[made].astype(np.float64)
    a, b, c, d, e, f = schedule.coefficients[schedule.entry_at(events.t[made])].T / float(1 << FRACTION_BITS)
    move_x, move_y = a * x + b * y + c, d * x + e * y + f
    off_x, off_y = events.x[met] - (x + move_x), events.y[met] - (y + move_y)
    delay = (events.t[met] - events.t[made] - config.horizon_us) / config.horizon_us
    shift = np.hypot(move_x, move_y) + 1e-9
    along = (off_x * move_x + off_y * move_y) / shift - shift * delay
    across = (off_y * move_x - off_x * move_y) / shift
    support = decisions.support[met].astype(np.float64)
    levels = [(support >= level).astype(np.float64) for level in (2, 3, 4)]
    late = [np.abs(delay), delay**2]
    whole, fine = np.hypot(np.rint(off_x), np.rint(off_y)), np.hypot(off_x, off_y)
    scores = {
        "support": [support],
        "and delay": [*levels, *late],
        "and distance": [*levels, *late, whole, whole**2],
        "below the pixel": [*levels, *late, fine, fine**2],
        "and from the line": [*levels, *late, fine, np.abs(along), along**2, np.abs(across), across**2],
    }
    middle = np.median(events.t[met])
    rest = counted & (events.t >= middle)
    totals = tuple(int(np.count_nonzero(rest & (events.label == label))) for label in (EGO, MOVER))
    columns = {name: np.column_stack(parts) for name, parts in scores.items()}
    return columns, events.label[met] == EGO, events.t[met] >= middle, (totals[0], totals[1])


def _logistic(columns: Floats, ego: NDArray[np.bool_], later: NDArray[np.bool_]) -> Floats:
    """Return the score of all rows, fitted by Newton's method on the earlier ones, ego and mover weighing alike."""
    rows = np.column_stack([columns, np.ones(len(columns))])
    known, wanted = rows[~later], ego[~later].astype(np.float64)
    weight = np.where(wanted > 0, 0.5 / max(wanted.sum(), 1), 0.5 / max((1 - wanted).sum(), 1)) * len(wanted)
    factors = np.zeros(rows.shape[1])
    for _ in range(25):
        chance = 1.0 / (1.0 + np.exp(-np.clip(known @ factors, -30, 30)))
        curve = weight * chance * (1 - chance) + 1e-9
        hessian = (known * curve[:, None]).T @ known + 1e-3 * np.eye(len(factors))
        factors += np.linalg.solve(hessian, known.T @ (weight * (wanted - chance)))
    score: Floats = rows @ factors
    return score


def _best(score: Floats, ego: NDArray[np.bool_], all_ego: int, all_mover: int) -> tuple[float, float, float]:
    """Return the best J of any threshold, with the shares of ego and mover at it."""
    order = np.argsort(-score, kind="stable")
    ends = np.append(np.diff(score[order]) != 0, True)
    kept = np.cumsum(ego[order])[ends] / all_ego
    lost = np.cumsum(~ego[order])[ends] / all_mover
    at = int(np.argmax(kept - lost))
    return float(kept[at] - lost[at]), float(kept[at]), float(lost[at])


if __name__ == "__main__":
    main()
