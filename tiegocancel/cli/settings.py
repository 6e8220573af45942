"""Merge a configuration file and the flags that override it into one Settings."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tiegocancel.config import fill, load_toml
from tiegocancel.errors import ConfigError

if TYPE_CHECKING:
    from tiegocancel.study.settings import Settings

__all__ = ["add_cancel_options", "add_estimate_options", "add_filter_options", "add_output_options", "settings_from"]

# Flag (as argparse names it) → table and key of the configuration file.
_KEYS = {
    "motion": ("motion", "source"),
    "refine": ("motion", "refine"),
    "motion_interpolation": ("motion", "interpolation"),
    "motion_path": ("motion", "path"),
    "schedule_step_us": ("motion", "schedule_step_us"),
    "hold_us": ("motion", "hold_us"),
    "hot_events": ("filter", "hot_events"),
    "flicker_periods": ("filter", "flicker_periods"),
    "refractory_us": ("filter", "refractory_us"),
    "background_us": ("filter", "background_us"),
    "guard": ("guard", "enabled"),
    "guard_max_loss": ("guard", "max_loss"),
    "method": ("estimate", "method"),
    "step_us": ("estimate", "step_us"),
    "window_us": ("estimate", "window_us"),
    "max_events": ("estimate", "max_events"),
    "max_omega": ("estimate", "max_omega_rad_s"),
    "estimate_seed": ("estimate", "seed"),
    "gyro": ("estimate", "gyro"),
    "gyro_axes": ("estimate", "gyro_axes"),
    "gyro_offset_us": ("estimate", "gyro_offset_us"),
    "gyro_bias": ("estimate", "gyro_bias"),
    "fusion": ("estimate", "fusion"),
    "alpha": ("estimate", "alpha"),
    "calibration": ("estimate", "calibration"),
    "horizon_us": ("cancel", "horizon_us"),
    "tolerance_us": ("cancel", "tolerance_us"),
    "tolerance_px": ("cancel", "tolerance_px"),
    "polarity": ("cancel", "polarity"),
    "ring_capacity": ("cancel", "ring_capacity"),
    "carry": ("cancel", "carry"),
    "need": ("cancel", "need"),
    "uses": ("cancel", "uses"),
    "least_shift_px": ("cancel", "least_shift_px"),
    "disc_radius_px": ("report", "disc_radius_px"),
    "controls": ("report", "controls"),
    "diagnose": ("report", "diagnose"),
    "shuffle_seed": ("report", "shuffle_seed"),
    "residual": ("output", "residual"),
    "figures": ("output", "figures"),
    "width": ("read", "width"),
    "height": ("read", "height"),
    "time_unit": ("read", "time_unit"),
    "columns": ("read", "columns"),
    "format": ("read", "format"),
    "chunk_events": ("read", "chunk_events"),
    "keep_going": ("read", "keep_going"),
    "undistort": ("read", "undistort"),
    "most_events": ("budget", "most_events"),
    "clock_mhz": ("budget", "clock_mhz"),
    "architecture": ("budget", "architecture"),
    "external_memory": ("budget", "external_memory"),
    "readout": ("budget", "readout_events_per_second"),
    "input_link": ("budget", "input_link_bits_per_second"),
    "output_link": ("budget", "output_link_bits_per_second"),
    "input_bits": ("budget", "input_bits_per_event"),
    "output_bits": ("budget", "output_bits_per_event"),
    "max_latency_us": ("budget", "max_latency_us"),
    "changes": ("budget", "changes"),
    "duration": ("simulate", "duration_s"),
    "seed": ("simulate", "seed"),
}


def add_cancel_options(parser: argparse.ArgumentParser) -> None:
    """Add the canceller's parameters; a flag that is not given leaves the configuration file's value."""
    group = parser.add_argument_group("canceller")
    group.add_argument(
        "--preset", metavar="NAME", help="operating point: plain, selective, two-speed, lean, dense; flags override it"
    )
    group.add_argument("--horizon-us", type=int, metavar="US", help="how far ahead to predict (8000; demo 40000)")
    group.add_argument("--tolerance-us", type=int, metavar="US", help="temporal gate, ± and inclusive (1000)")
    group.add_argument("--tolerance-px", type=float, metavar="PX", help="spatial gate, a radius, inclusive (2)")
    group.add_argument("--polarity", choices=("opposite", "equal", "ignore"), help="what an event may meet (opposite)")
    group.add_argument("--ring-capacity", type=int, metavar="N", help="pending predictions (65536; demo 262144)")
    group.add_argument("--carry", type=int, metavar="N", help="most support that an event hands on (0)")
    group.add_argument("--need", type=int, metavar="N", help="least support that suppresses (1)")
    group.add_argument("--uses", type=int, metavar="N", help="hits that a cell can bear, 0 for any number (1)")
    group.add_argument("--least-shift-px", type=float, metavar="PX", help="predict nothing that moves less (0)")
    group.add_argument(
        "--motion-path",
        choices=("integer", "float"),
        help="fixed-point schedule (default) or interpolation at each event",
    )
    group.add_argument("--refine", action="store_true", help="correct centre and ω by the residuals of a sample")
    group.add_argument(
        "--motion-interpolation",
        choices=("file", "linear", "spline", "causal"),
        help="between the rows of a CSV (file: as the file itself says, the default)",
    )
    group.add_argument("--schedule-step-us", type=int, metavar="US", help="time between schedule entries (1000)")
    group.add_argument(
        "--hold-us",
        type=int,
        metavar="US",
        help="a motion found on the way is unknown so long after its last confident row (30000; 0 never)",
    )
    group.add_argument(
        "--guard",
        action="store_true",
        default=None,
        help="suppress nothing while the motion does not do better than no motion",
    )
    group.add_argument(
        "--guard-max-loss",
        type=float,
        metavar="L",
        help="under --guard, ask for more support until zero motion meets no more than this share of events (1)",
    )


def add_filter_options(parser: argparse.ArgumentParser) -> None:
    """Add the filters that events pass first; their other parameters stand in the table [filter]."""
    group = parser.add_argument_group("filters before it (0, the default, leaves each one out)")
    group.add_argument("--hot-events", type=int, metavar="N", help="events that a pixel may fire in 100 ms")
    group.add_argument("--flicker-periods", type=int, metavar="N", help="periods of a lamp that mute a pixel")
    group.add_argument("--refractory-us", type=int, metavar="US", help="rest of a pixel after an event")
    group.add_argument("--background-us", type=int, metavar="US", help="a neighbour must have fired within this time")


def add_estimate_options(parser: argparse.ArgumentParser) -> None:
    """Add how the motion is found from past events and a gyroscope."""
    group = parser.add_argument_group("estimating the motion")
    group.add_argument(
        "--method", choices=("contrast", "circle", "gyro"), help="warped events (default), circle fit, gyroscope alone"
    )
    group.add_argument(
        "--step-us", type=int, metavar="US", help="time between estimates (10000; circle 2000, gyro 1000)"
    )
    group.add_argument("--window-us", type=int, metavar="US", help="past that an estimate looks at (20000)")
    group.add_argument(
        "--window-events", type=int, dest="max_events", metavar="N", help="events that a window draws (20000)"
    )
    group.add_argument("--max-omega", type=float, metavar="RAD_S", help="largest angular velocity sought (200)")
    group.add_argument("--estimate-seed", type=int, metavar="N", help="seed of the draws (0)")
    group.add_argument("--gyro", metavar="FILE", help="gyroscope: AEDAT4 or CSV; fused, or used alone by gyro")
    group.add_argument("--gyro-axes", metavar="MAP", help="the gyroscope's axes that lie right, down, forward: -x,y,-z")
    group.add_argument("--gyro-offset-us", type=int, metavar="US", help="added to the gyroscope's times (0)")
    group.add_argument("--gyro-bias", choices=("rest", "none"), help="found whenever it rests (default), or none")
    group.add_argument("--fusion", choices=("kalman", "exponential"), help="of events and gyroscope (kalman)")
    group.add_argument(
        "--alpha", type=float, metavar="A", help="weight of a new value in the exponential average (0.2)"
    )
    group.add_argument(
        "--calibration", metavar="FILE", help="intrinsics of the camera, for a gyroscope or motion about three axes"
    )


def add_output_options(parser: argparse.ArgumentParser) -> None:
    """Add what is measured and written."""
    group = parser.add_argument_group("output")
    group.add_argument(
        "--out", type=Path, default=Path("tiegocancel-out"), metavar="DIR", help="folder for all results"
    )
    group.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    group.add_argument("--residual", metavar="FORMAT", help="of residual events: npz (default), npy, csv, evt2, none")
    group.add_argument("--disc-radius-px", type=float, metavar="PX", help="radius of the disc that turns (guessed)")
    group.add_argument("--no-controls", dest="controls", action="store_false", default=None, help="skip the controls")
    group.add_argument("--no-diagnosis", dest="diagnose", action="store_false", default=None, help="skip the diagnosis")
    group.add_argument("--no-figures", dest="figures", action="store_false", default=None, help="skip the figures")
    group.add_argument("--shuffle-seed", type=int, metavar="N", help="seed of the time-shuffled control")
    group.add_argument("--config", type=Path, metavar="FILE", help="TOML file with every setting; flags override it")


def settings_from(
    args: argparse.Namespace, defaults: dict[str, dict[str, Any]] | None = None, *, aside: tuple[str, ...] = ()
) -> Settings:
    """Return the settings: ``defaults`` of the verb, then the file, then the flags that were given.

    Tables named in ``aside`` are the verb's own, and left to it.
    """
    from tiegocancel.study.settings import Settings

    tables: dict[str, Any] = {name: dict(table) for name, table in (defaults or {}).items()}
    where = "settings"
    if args.config is not None:
        where = str(args.config)
        for name, table in load_toml(args.config).items():
            if name in aside:
                continue
            if not isinstance(table, dict):
                raise ConfigError(f"{where}: {name} must be a table ([{name}]), not {table!r}")
            tables[name] = {**tables.get(name, {}), **table}
    _lay_under_cancel_preset(tables, getattr(args, "preset", None), where, (defaults or {}).get("cancel", {}))
    for flag, (name, key) in _KEYS.items():
        value = getattr(args, flag, None)
        if value is None or (flag in ("keep_going", "refine") and not value):
            continue
        tables[name] = {**tables.get(name, {}), key: value}
    _lay_under_preset(tables)
    return fill(Settings, tables, where)


def _lay_under_cancel_preset(tables: dict[str, Any], flag: str | None, where: str, defaults: dict[str, Any]) -> None:
    """Put the named operating point under what the file says of ``[cancel]``, instead of the verb's own."""
    given = tables.get("cancel", {})
    name = given.get("preset") if flag is None else flag
    if name is None:
        return
    from tiegocancel.matching.presets import preset_table

    own = {key: value for key, value in given.items() if key != "preset" and defaults.get(key) != value}
    tables["cancel"] = {**preset_table(name, "--preset" if flag else f"{where} [cancel] preset"), **own}


def _lay_under_preset(tables: dict[str, Any]) -> None:
    """Let a shared file name a scene of the library in ``[simulate] kind``, as the verb simulate does."""
    simulate = tables.get("simulate", {})
    kind = simulate.get("kind", "disc") if isinstance(simulate, dict) else "disc"
    if not isinstance(kind, str) or kind in ("disc", "camera"):
        return
    from tiegocancel.scene.library import preset_named

    preset = preset_named(kind)
    own = tables.get(preset.table_name, {})
    if isinstance(own, dict):
        tables[preset.table_name] = preset.under(own)
        tables["simulate"] = {**simulate, "kind": preset.kind}
