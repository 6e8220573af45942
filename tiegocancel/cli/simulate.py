"""``tiegocancel simulate OUT``: write a recording of a built-in scene, with labels and its true motion."""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tiegocancel.units import rate_text

if TYPE_CHECKING:
    from tiegocancel.scene import CameraSceneConfig, SceneConfig
    from tiegocancel.study.settings import Settings

__all__ = ["add_parser", "run"]

LABELS = ("ego", "mover", "noise")


class _ListScenes(argparse.Action):
    """Print the names of the library, a line each: read when asked for, so that ``--help`` stays instant."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option: str | None = None
    ) -> None:
        from tiegocancel.scene.library import SCENES

        sys.stdout.writelines(f"{name:12} {preset.about}\n" for name, preset in SCENES.items())
        parser.exit()


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "simulate",
        help="write a recording of a built-in scene",
        description="Simulate an event camera that looks at a turning textured disc, or one that rolls and pans "
        "before a far textured world, and a hand that crosses the image. Labels (0 ego, 1 mover, 2 noise) go into OUT "
        "or beside it, the true motion into OUT's stem + .motion.csv; the rolling camera has .gyro.csv and "
        ".calibration.toml as well.",
    )
    parser.add_argument("out", type=Path, metavar="OUT", help="recording to write; the suffix chooses the format")
    parser.add_argument("--scene", metavar="NAME", help="a scene of the library (disc)")
    parser.add_argument("--list-scenes", action=_ListScenes, nargs=0, help="say which scenes there are, and leave")
    parser.add_argument("--duration", type=float, metavar="S", help="seconds of the scene (0.5)")
    parser.add_argument("--seed", type=int, metavar="N", help="seed of the scene's sensor (0)")
    parser.add_argument("--width", type=int, metavar="PX", help="sensor width (disc 1280, camera 640)")
    parser.add_argument("--height", type=int, metavar="PX", help="sensor height (disc 720, camera 480)")
    parser.add_argument("--omega", type=float, metavar="RAD_S", help="the disc's, positive turns x to y (3.6)")
    parser.add_argument(
        "--relative",
        type=float,
        metavar="PX_S",
        help="two-movers: how fast the second hand passes over the print (100)",
    )
    parser.add_argument("--no-mover", dest="mover", action="store_false", default=None, help="leave the hand out")
    parser.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="TOML file with [scene], [camera_scene], [simulate]; flags override it",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    name, settings = _settings(args)
    import numpy as np

    from tiegocancel.cli.progress import event_progress
    from tiegocancel.files import open_writer
    from tiegocancel.scene import simulate, write_sidecars

    duration_s, seed = settings.simulate.duration_s, settings.simulate.seed
    scene: SceneConfig | CameraSceneConfig
    if settings.simulate.kind == "disc":
        scene = settings.scene
        motion: dict[str, Any] = {"center_px": list(scene.rig.center_px), "omega_rad_s": scene.rig.omega_rad_s}
    else:
        scene = settings.camera_scene
        motion = {"focal_px": scene.focal_px, "principal_px": list(scene.principal_px), **asdict(scene.motion)}
    chunks = simulate(scene, duration_s=duration_s, seed=seed)
    counts = np.zeros(len(LABELS), np.int64)
    begin_s = time.perf_counter()
    with (
        open_writer(args.out, width=scene.width, height=scene.height, labelled=True) as writer,
        event_progress("simulating", round(duration_s * 1e6)) as advance,
    ):
        for chunk in chunks:
            writer.write(chunk)
            counts += np.bincount(np.asarray(chunk.label), minlength=len(LABELS))
            advance(chunk)
    for note in writer.notes:
        sys.stderr.write(f"note: {note}\n")
    paths = write_sidecars(scene, args.out, duration_s=duration_s, seed=seed)
    events, seconds = int(counts.sum()), time.perf_counter() - begin_s
    rate_hz = events / duration_s if duration_s else 0.0
    shares = ", ".join(f"{count:,} {name}" for name, count in zip(LABELS, counts.tolist(), strict=True))
    sys.stderr.write(
        f"{args.out}: {events:,} events in {duration_s:g} s ({rate_text(rate_hz)}: {shares}); "
        f"{', '.join(f'{name} in {path}' for name, path in paths.items())}; took {seconds:.1f} s\n"
    )
    if args.json:
        result = {
            "events": events,
            "scene": name,
            "duration_s": duration_s,
            "event_rate_hz": rate_hz,
            "labels": dict(zip(LABELS, counts.tolist(), strict=True)),
            "width": scene.width,
            "height": scene.height,
            "seed": seed,
            "motion": motion,
            "paths": {"events": str(args.out), **{name: str(path) for name, path in paths.items()}},
            "seconds": seconds,
            "events_per_second": events / seconds,
        }
        sys.stdout.write(json.dumps(result) + "\n")
    return 0


def _settings(args: argparse.Namespace) -> tuple[str, Settings]:
    """Return the scene's name and the settings: the scene's own, the file's tables on them, the flags on top."""
    from tiegocancel.config import fill, load_toml
    from tiegocancel.errors import ConfigError
    from tiegocancel.scene.library import preset_named
    from tiegocancel.study.settings import Settings

    tables: dict[str, Any] = load_toml(args.config) if args.config is not None else {}
    where = str(args.config) if args.config is not None else "flags"
    simulated = tables.setdefault("simulate", {})
    kind = args.scene or (simulated.get("kind") if isinstance(simulated, dict) else None) or "disc"
    preset = preset_named(kind, "--scene" if args.scene else f"{where} [simulate] kind")
    scene = preset.table_name
    if preset.kind == "camera" and args.omega is not None:
        raise ConfigError(f"{where}: --omega belongs to the disc; of the camera, set [camera_scene.motion] in a file")
    if args.relative is not None and "companion" not in preset.table:
        raise ConfigError(f"{where}: --relative belongs to the scene two-movers, not to {kind}")
    flags = (
        ((scene, "width"), args.width),
        ((scene, "height"), args.height),
        (("scene", "rig", "omega_rad_s"), args.omega),
        (("scene", "companion", "relative_px_s"), args.relative),
        ((scene, "mover", "enabled"), args.mover),
        (("simulate", "kind"), preset.kind),
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
    if isinstance(tables.setdefault(scene, {}), dict):
        tables[scene] = preset.under(tables[scene])
    return str(kind), fill(Settings, tables, where)
