"""``tiegocancel export SOURCE``: write golden vectors for RTL and firmware."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tiegocancel.cli.options import add_reading_options
from tiegocancel.cli.progress import event_progress
from tiegocancel.cli.settings import add_cancel_options, add_estimate_options, add_filter_options, settings_from
from tiegocancel.errors import ConfigError

if TYPE_CHECKING:
    from tiegocancel.firmware_sim.export import Vectors
    from tiegocancel.study.settings import Settings

__all__ = ["add_parser", "run"]


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "export",
        help="write golden vectors for RTL and firmware",
        description="Write input packets, expected decisions, the fixed-point schedule and every parameter as "
        "$readmemh images, C99 headers and JSON. The state is empty before the first event, as a device's is after "
        "reset: the semantics need it from the beginning, so vectors never start warm.",
    )
    parser.add_argument("source", type=Path, metavar="SOURCE", help="recording: npz, npy, csv, txt, raw, dat, aedat, …")
    parser.add_argument(
        "--motion",
        metavar="M",
        help="fit (default), track, gyro, CX,CY,OMEGA in px and rad/s, a CSV of the motion, or a schedule file",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("tiegocancel-vectors"), metavar="DIR", help="folder for all files"
    )
    parser.add_argument("--from-us", type=int, metavar="US", help="begin at this time (that of the first event)")
    parser.add_argument(
        "--max-events", type=int, metavar="N", help="events to export (the warm-up and 4096 beyond it, at most 262144)"
    )
    parser.add_argument(
        "--core-clock-mhz",
        type=float,
        metavar="MHZ",
        help="write arrival and decision cycles of the core of [core] at this clock too",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML file with every setting; flags override it")
    add_cancel_options(parser)
    add_filter_options(parser)
    add_estimate_options(parser)
    add_reading_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    settings = settings_from(args)
    clock_hz = _checked(args, settings)
    from tiegocancel.cli.outputs import OutputFolder
    from tiegocancel.errors import InputError
    from tiegocancel.files import open_events
    from tiegocancel.firmware_sim.export import FILES, read_vectors, write_vectors
    from tiegocancel.study.motion_source import motion_inputs

    inputs = [args.source, *motion_inputs(settings), *([] if args.config is None else [args.config])]
    folder = OutputFolder(args.out, inputs, command=args.command, keep_clear=list(FILES))
    with open_events(args.source, **asdict(settings.read)) as reader:
        vectors, notes = _vectors(args, settings, reader)
    if clock_hz is not None:
        vectors = _with_cycles(vectors, settings, clock_hz)
    notes += _remarks(vectors, settings)
    for note in notes:
        sys.stderr.write(f"note: {note}\n")
    folder.prepare()
    written = write_vectors(folder.path, vectors, command=args.command)
    for name in written:
        folder.file(name)
    wrong = vectors.differences(read_vectors(folder.path))
    if wrong:
        raise InputError(folder.path, "", f"what was written does not read back: {', '.join(wrong)}")
    numbers = _numbers(vectors) | {"files": written, "notes": notes, "out": str(folder.path)}
    folder.write_manifest(settings, numbers)
    sys.stdout.write(json.dumps(numbers) + "\n" if args.json else _text(vectors, numbers))
    return 0


def _checked(args: argparse.Namespace, settings: Settings) -> float | None:
    """Return the clock in Hz, ``None`` without one; refuse what cannot be exported."""
    if settings.motion.path == "float":
        raise ConfigError("--motion-path float: vectors are of the fixed-point schedule; leave it at integer")
    if args.max_events is not None and args.max_events < 1:
        raise ConfigError(f"--max-events: must be at least 1, not {args.max_events}")
    mhz = args.core_clock_mhz
    if mhz is None:
        return None
    if not 0.001 <= mhz <= 1e5:
        raise ConfigError(f"--core-clock-mhz: must be from 0.001 to 100000 MHz, not {mhz:g}")
    return float(mhz * 1e6)


def _vectors(args: argparse.Namespace, settings: Settings, reader: Any) -> tuple[Vectors, list[str]]:
    """Read the stretch, find its motion and decide it; return remarks beside the vectors."""
    from tiegocancel.cli.run import sample_of
    from tiegocancel.errors import InputError
    from tiegocancel.firmware_sim.export import golden_vectors
    from tiegocancel.study.beginning import motion_of, take_beginning
    from tiegocancel.study.feed import TrackedMotion
    from tiegocancel.study.motion_source import open_motion
    from tiegocancel.study.prefilter import Prefilter

    config = settings.cancel
    with event_progress("finding the motion", None) as advance:
        found = open_motion(
            settings, sample=lambda: sample_of(reader, settings, advance), width=reader.width, height=reader.height
        )
    if isinstance(found.feed, TrackedMotion):
        found.feed.hold_us = settings.motion.hold_us
    prefilter = Prefilter(settings.filter)
    events = take_beginning(
        prefilter.kept(reader), found.feed, config, from_us=args.from_us, max_events=args.max_events
    )
    if events is None:
        prefilter.check_something_left()
        since = "" if args.from_us is None else f" at {args.from_us} µs or later (--from-us)"
        raise InputError(args.source, "", f"holds no events{since}")
    trajectory = found.feed.trajectory
    notes = [*dict.fromkeys(reader.notes), *(f"refining: {one.text}" for one in found.diagnoses)]
    notes += ["no motion was found: nothing is predicted"] if trajectory is None else trajectory.notes
    with event_progress("deciding", events.span_us) as advance:
        try:
            schedules = motion_of(found.feed, config, events, step_us=settings.motion.schedule_step_us)
            return golden_vectors(events, config, schedules, progress=advance), notes
        except ValueError as error:
            raise ConfigError(f"--motion {settings.motion.source}: {error}") from error


def _with_cycles(vectors: Vectors, settings: Settings, clock_hz: float) -> Vectors:
    """Return the vectors with the cycles of the core of the settings."""
    from tiegocancel.firmware_sim.export import core_cycles

    try:
        return replace(vectors, cycles=core_cycles(vectors, settings.core, clock_hz=clock_hz))
    except ValueError as error:
        raise ConfigError(f"--core-clock-mhz: {error}") from error


def _remarks(vectors: Vectors, settings: Settings) -> list[str]:
    """Say what the user should know before a device is held to these vectors."""
    events, config = vectors.events, vectors.config
    notes = []
    if not vectors.suppressed.any():
        notes.append(
            f"nothing is suppressed within {events.span_us / 1000:g} ms; the warm-up from an empty state takes "
            f"{config.warm_up_us / 1000:g} ms: a larger --max-events, or a shorter --horizon-us, tests more"
        )
    if settings.guard.enabled:
        notes.append("the guard is left out: vectors are of the canceller alone")
    if vectors.cycles is not None and vectors.cycles.dropped.any():
        notes.append(
            f"the core drops {int(vectors.cycles.dropped.sum()):,} events at {vectors.cycles.clock_hz / 1e6:g} MHz; "
            "decisions.memh is without drops, cycles.memh with them"
        )
    return notes


def _numbers(vectors: Vectors) -> dict[str, Any]:
    """Return what there is to say of the vectors, for JSON."""
    events = vectors.events
    numbers: dict[str, Any] = {
        "events": len(events),
        "width": events.width,
        "height": events.height,
        "first_us": int(events.t[0]),
        "last_us": int(events.t[-1]),
        "time_base_us": vectors.time_base_us,
        "suppressed": int(vectors.suppressed.sum()),
        "largest_support": int(vectors.support.max()),
        "horizons_us": list(vectors.config.horizons_us),
        "schedule_entries": len(vectors.schedules[0]),
        "cycles": None,
    }
    if vectors.cycles is not None:
        kept = ~vectors.cycles.dropped
        latency = vectors.cycles.decided[kept] - vectors.cycles.arrival[kept]
        numbers["cycles"] = {
            "clock_hz": vectors.cycles.clock_hz,
            "dropped": int(vectors.cycles.dropped.sum()),
            "suppressed": int(vectors.cycles.suppressed.sum()),
            "latency_mean": float(latency.mean()),
            "latency_max": int(latency.max()),
        }
    return numbers


def _text(vectors: Vectors, numbers: dict[str, Any]) -> str:
    """Say the main numbers in a few lines."""
    events = vectors.events
    lines = [
        f"  events       {len(events):,} of {events.width}×{events.height} px in {events.span_us / 1000:g} ms, "
        "from an empty state on",
        f"  suppressed   {numbers['suppressed']:,} ({numbers['suppressed'] / len(events):.1%}), support up to "
        f"{numbers['largest_support']}",
        f"  schedule     {numbers['schedule_entries']} entries for each of {len(numbers['horizons_us'])} horizons",
    ]
    core = numbers["cycles"]
    if core is not None:
        lines.append(
            f"  core         {core['clock_hz'] / 1e6:g} MHz: decided {core['latency_mean']:.1f} cycles after arrival, "
            f"at most {core['latency_max']}; {core['dropped']:,} dropped"
        )
    lines += [f"  {name:21} {record['bytes']:>12,} bytes" for name, record in numbers["files"].items()]
    return "\n".join(lines) + f"\nvectors: {numbers['out']}\n"
