"""Merge a configuration file and the flags that override it into one Settings."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tiegocancel.config import fill, load_toml
from tiegocancel.errors import ConfigError

if TYPE_CHECKING:
    from tiegocancel.study.settings import Settings

__all__ = ["add_cancel_options", "add_output_options", "settings_from"]

# Flag (as argparse names it) → table and key of the configuration file.
_KEYS = {
    "motion": ("motion", "source"),
    "motion_path": ("motion", "path"),
    "schedule_step_us": ("motion", "schedule_step_us"),
    "horizon_us": ("cancel", "horizon_us"),
    "tolerance_us": ("cancel", "tolerance_us"),
    "tolerance_px": ("cancel", "tolerance_px"),
    "polarity": ("cancel", "polarity"),
    "ring_capacity": ("cancel", "ring_capacity"),
    "disc_radius_px": ("report", "disc_radius_px"),
    "controls": ("report", "controls"),
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
    "duration": ("simulate", "duration_s"),
    "seed": ("simulate", "seed"),
}


def add_cancel_options(parser: argparse.ArgumentParser) -> None:
    """Add the canceller's parameters; a flag that is not given leaves the configuration file's value."""
    group = parser.add_argument_group("canceller")
    group.add_argument("--horizon-us", type=int, metavar="US", help="how far ahead to predict (8000; demo 40000)")
    group.add_argument("--tolerance-us", type=int, metavar="US", help="temporal gate, ± and inclusive (1000)")
    group.add_argument("--tolerance-px", type=float, metavar="PX", help="spatial gate, a radius, inclusive (2)")
    group.add_argument("--polarity", choices=("opposite", "equal", "ignore"), help="what an event may meet (opposite)")
    group.add_argument("--ring-capacity", type=int, metavar="N", help="pending predictions (65536; demo 262144)")
    group.add_argument(
        "--motion-path",
        choices=("integer", "float"),
        help="fixed-point schedule (default) or interpolation at each event",
    )
    group.add_argument("--schedule-step-us", type=int, metavar="US", help="time between schedule entries (1000)")


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
    group.add_argument("--no-figures", dest="figures", action="store_false", default=None, help="skip the figures")
    group.add_argument("--shuffle-seed", type=int, metavar="N", help="seed of the time-shuffled control")
    group.add_argument("--config", type=Path, metavar="FILE", help="TOML file with every setting; flags override it")


def settings_from(args: argparse.Namespace, defaults: dict[str, dict[str, Any]] | None = None) -> Settings:
    """Return the settings: ``defaults`` of the verb, then the file, then the flags that were given."""
    from tiegocancel.study.settings import Settings

    tables: dict[str, Any] = {name: dict(table) for name, table in (defaults or {}).items()}
    where = "settings"
    if args.config is not None:
        where = str(args.config)
        for name, table in load_toml(args.config).items():
            if not isinstance(table, dict):
                raise ConfigError(f"{where}: {name} must be a table ([{name}]), not {table!r}")
            tables[name] = {**tables.get(name, {}), **table}
    for flag, (name, key) in _KEYS.items():
        value = getattr(args, flag, None)
        if value is None or (flag == "keep_going" and not value):
            continue
        tables[name] = {**tables.get(name, {}), key: value}
    return fill(Settings, tables, where)
