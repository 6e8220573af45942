"""``tiegocancel simulate OUT``: write a recording of the built-in scene, with labels and its true motion."""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tiegocancel.study.settings import Settings
from tiegocancel.units import rate_text

__all__ = ["add_parser", "run"]

LABELS = ("ego", "mover", "noise")


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "simulate",
        help="write a recording of the built-in scene",
        description="Simulate an event camera that looks at a turning textured disc and a hand that crosses it. "
        "Labels (0 ego, 1 mover, 2 noise) go into OUT or beside it, the true motion into OUT's stem + .motion.csv.",
    )
    parser.add_argument("out", type=Path, metavar="OUT", help="recording to write; the suffix chooses the format")
    parser.add_argument("--duration", type=float, metavar="S", help="seconds of the scene (0.5)")
    parser.add_argument("--seed", type=int, metavar="N", help="seed of the scene's sensor (0)")
    parser.add_argument("--width", type=int, metavar="PX", help="sensor width (1280); the scene is scaled to fit")
    parser.add_argument("--height", type=int, metavar="PX", help="sensor height (720)")
    parser.add_argument("--omega", type=float, metavar="RAD_S", help="angular velocity, positive turns x to y (3.6)")
    parser.add_argument("--no-mover", dest="mover", action="store_false", default=None, help="leave the hand out")
    parser.add_argument(
        "--config", type=Path, metavar="FILE", help="TOML file with [scene] and [simulate]; flags override it"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    settings = _settings(args)
    import numpy as np

    from tiegocancel.cli.progress import event_progress
    from tiegocancel.files import open_writer
    from tiegocancel.scene import ground_truth, simulate

    scene, duration_s, seed = settings.scene, settings.simulate.duration_s, settings.simulate.seed
    motion_path = args.out.with_name(args.out.stem + ".motion.csv")
    counts = np.zeros(len(LABELS), np.int64)
    begin_s = time.perf_counter()
    with (
        open_writer(args.out, width=scene.width, height=scene.height, labelled=True) as writer,
        event_progress("simulating", round(duration_s * 1e6)) as advance,
    ):
        for chunk in simulate(scene, duration_s=duration_s, seed=seed):
            writer.write(chunk)
            counts += np.bincount(np.asarray(chunk.label), minlength=len(LABELS))
            advance(chunk)
    for note in writer.notes:
        sys.stderr.write(f"note: {note}\n")
    ground_truth(scene, duration_s=duration_s).to_csv(motion_path)
    events, seconds = int(counts.sum()), time.perf_counter() - begin_s
    rate_hz = events / duration_s if duration_s else 0.0
    shares = ", ".join(f"{count:,} {name}" for name, count in zip(LABELS, counts.tolist(), strict=True))
    sys.stderr.write(
        f"{args.out}: {events:,} events in {duration_s:g} s ({rate_text(rate_hz)}: {shares}); "
        f"motion in {motion_path}; took {seconds:.1f} s\n"
    )
    if args.json:
        result = {
            "events": events,
            "duration_s": duration_s,
            "event_rate_hz": rate_hz,
            "labels": dict(zip(LABELS, counts.tolist(), strict=True)),
            "width": scene.width,
            "height": scene.height,
            "seed": seed,
            "motion": {"center_px": list(scene.rig.center_px), "omega_rad_s": scene.rig.omega_rad_s},
            "paths": {"events": str(args.out), "motion": str(motion_path)},
            "seconds": seconds,
            "events_per_second": events / seconds,
        }
        sys.stdout.write(json.dumps(result) + "\n")
    return 0


def _settings(args: argparse.Namespace) -> Settings:
    """Return the settings: the file's tables, with the flags that were given on top."""
    from tiegocancel.config import fill, load_toml
    from tiegocancel.errors import ConfigError
    from tiegocancel.study.settings import Settings

    tables: dict[str, Any] = load_toml(args.config) if args.config is not None else {}
    where = str(args.config) if args.config is not None else "flags"
    flags = (
        (("scene", "width"), args.width),
        (("scene", "height"), args.height),
        (("scene", "rig", "omega_rad_s"), args.omega),
        (("scene", "mover", "enabled"), args.mover),
        (("simulate", "duration_s"), args.duration),
        (("simulate", "seed"), args.seed),
    )
    for keys, value in flags:
        if value is None:
            continue
        table = tables
        for depth, key in enumerate(keys[:-1], 1):
            table = table.setdefault(key, {})
            if not isinstance(table, dict):
                raise ConfigError(f"{where}: {'.'.join(keys[:depth])} must be a table, not {table!r}")
        table[keys[-1]] = value
    return fill(Settings, tables, where)
