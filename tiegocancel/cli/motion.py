"""``tiegocancel motion SOURCE``: estimate the motion of a recording causally, row by row."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tiegocancel.cli.options import add_reading_options
from tiegocancel.cli.progress import event_progress
from tiegocancel.cli.settings import add_estimate_options, add_filter_options, settings_from

if TYPE_CHECKING:
    from tiegocancel.estimation.inertial.gyro import GyroSamples
    from tiegocancel.files import EventReader
    from tiegocancel.motion.trajectory import Trajectory
    from tiegocancel.study.settings import Settings

__all__ = ["add_parser", "run"]

_FIGURE, _MANIFEST = ".png", ".manifest.json"


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "motion",
        help="estimate the motion of a recording",
        description="Estimate the motion of a recording from past events, a gyroscope, or both: a CSV with one row an "
        "estimate, each made of what came before it alone, a figure, and on demand a schedule file for one horizon.",
    )
    parser.add_argument("source", type=Path, metavar="SOURCE", help="recording: npz, npy, csv, txt, raw, dat, aedat, …")
    parser.add_argument(
        "--out", type=Path, default=Path("motion.csv"), metavar="FILE", help="CSV to write (motion.csv)"
    )
    parser.add_argument("--truth", type=Path, metavar="FILE", help="CSV of the true motion: errors, and drawn beneath")
    parser.add_argument("--schedule", type=Path, metavar="FILE", help="write the fixed-point schedule too")
    parser.add_argument("--horizon-us", type=int, metavar="US", help="horizon of the schedule (8000)")
    parser.add_argument("--schedule-step-us", type=int, metavar="US", help="time between schedule entries (1000)")
    parser.add_argument(
        "--find-offset", action="store_true", help="find the gyroscope's time offset first, from events"
    )
    parser.add_argument("--no-figures", dest="figures", action="store_false", default=None, help="skip the figure")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML file with every setting; flags override it")
    add_filter_options(parser)
    add_estimate_options(parser)
    add_reading_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb; return 1 when the recording ended in a fault, 130 when the user ended it."""
    settings = settings_from(args)
    _check(args, settings)
    from tiegocancel.errors import InputError
    from tiegocancel.estimation.estimates_csv import EstimateWriter
    from tiegocancel.files import open_events
    from tiegocancel.motion.rotation import RotationTrajectory
    from tiegocancel.study.estimation_run import estimate_stream
    from tiegocancel.study.estimators import build_estimator, camera_motion, gyro_of
    from tiegocancel.study.prefilter import Prefilter, filter_numbers, filter_text

    truth = None if args.truth is None else RotationTrajectory.from_csv(args.truth)
    with open_events(args.source, **asdict(settings.read)) as reader:
        gyro = gyro_of(settings.estimate)
        notes = [] if gyro is None else list(gyro.notes)
        if args.find_offset:
            gyro, offset = _with_offset(settings, reader, gyro)
            notes += offset
        estimator = build_estimator(settings.estimate, width=reader.width, height=reader.height, gyro=gyro)
        prefilter = Prefilter(settings.filter)
        turns = settings.estimate.method == "gyro" and settings.estimate.calibration is not None
        with EstimateWriter(args.out, turns=turns) as writer, event_progress("estimating", None) as advance:
            found = estimate_stream(prefilter.kept(reader), estimator, sink=writer.extend, progress=advance)
        three_axes: Trajectory | None = None
        if turns and gyro is not None:
            camera = camera_motion(
                settings.estimate,
                gyro,
                width=reader.width,
                height=reader.height,
                undistorted=settings.read.undistort is not None,
            )
            three_axes = camera.reported(settings.cancel.horizon_us)
        notes += [*reader.notes]
    if not found.events:
        prefilter.check_something_left()
        raise InputError(args.source, "", "holds no events")
    written = {"estimates": str(args.out)}
    motion = three_axes or found.trajectory(source=args.out.name)
    if motion is None:
        notes.append("no motion was found" + (": no schedule is written" if args.schedule is not None else ""))
    else:
        notes += motion.notes
    if motion is not None and args.schedule is not None:
        from tiegocancel.motion.schedule_file import write_schedule
        from tiegocancel.study.feed import fixed_schedule

        schedule = fixed_schedule(
            motion, settings.cancel.horizon_us, int(motion.t_us[0]), settings.motion.schedule_step_us
        )
        write_schedule(schedule, args.schedule)
        written["schedule"] = str(args.schedule)
    if settings.output.figures and any(estimate.has_center for estimate in found.estimates):
        from tiegocancel.report.motion import draw_motion

        picture = args.out.with_suffix(_FIGURE)
        draw_motion(picture, found.estimates, truth)
        written["figure"] = str(picture)
    notes = list(dict.fromkeys(notes))  # the gyroscope of three axes has the same remarks once more
    for note in notes:
        sys.stderr.write(f"note: {note}\n")
    filtered, state = prefilter.counters, prefilter.state
    numbers = found.summary(truth) | {"notes": notes, "paths": written, "fault": found.fault}
    numbers["filter"] = filter_numbers(filtered, state)
    _write_manifest(args, settings, numbers)
    if args.json:
        sys.stdout.write(json.dumps(numbers) + "\n")
    else:
        told = "" if filtered is None or state is None else f"  filters      {filter_text(filtered, state)}\n"
        sys.stdout.write(found.text(truth) + told + f"rows: {args.out}\n")
    if found.fault is None:
        return 0 if args.schedule is None or motion is not None else 1
    sys.stderr.write(f"tiegocancel: {found.fault}\n")
    return 130 if found.interrupted else 1


def _check(args: argparse.Namespace, settings: Settings) -> None:
    """Refuse to write over an input or over another file of this run, and a calibration without use."""
    from tiegocancel.errors import ConfigError

    calibration = settings.estimate.calibration
    if calibration is not None and settings.estimate.method != "gyro":
        raise ConfigError(f"--calibration {calibration}: serves --method gyro, not {settings.estimate.method}")
    outputs = {"--out": args.out, "--out, its manifest": args.out.with_suffix(_MANIFEST)}
    if settings.output.figures:
        outputs["--out, its figure"] = args.out.with_suffix(_FIGURE)
    if args.schedule is not None:
        outputs["--schedule"] = args.schedule
    taken = {path.resolve(): str(path) for path in (*_inputs(args, settings), args.config) if path is not None}
    for name, path in outputs.items():
        if path.resolve() in taken:
            raise ConfigError(f"{name}: {path} would be written over {taken[path.resolve()]}")
        taken[path.resolve()] = name


def _inputs(args: argparse.Namespace, settings: Settings) -> list[Path]:
    """Name the files that are read, for the manifest."""
    named = (args.source, args.truth, settings.estimate.gyro, settings.estimate.calibration)
    return [Path(name) for name in named if name is not None]


def _with_offset(settings: Settings, reader: EventReader, gyro: GyroSamples | None) -> tuple[GyroSamples, list[str]]:
    """Return the gyroscope on the events' clock, by what events and gyroscope have in common, and remarks on it."""
    from tiegocancel.errors import ConfigError
    from tiegocancel.estimation.inertial.time_offset import offset_of_estimates
    from tiegocancel.study.estimation_run import estimate_stream
    from tiegocancel.study.estimators import agile_estimator
    from tiegocancel.study.prefilter import Prefilter

    if gyro is None:
        raise ConfigError("--find-offset: no gyroscope is given; name its file with --gyro")
    if settings.estimate.method == "gyro":
        raise ConfigError("--find-offset: needs estimates from events; give --method contrast")
    alone = agile_estimator(settings.estimate, width=reader.width, height=reader.height)
    with event_progress("finding the time offset", None) as advance:
        found = estimate_stream(Prefilter(settings.filter).kept(reader), alone, progress=advance)
    offset = offset_of_estimates(found.estimates, gyro)
    if not offset.confident:
        return gyro, [offset.text]
    whole_us = settings.estimate.gyro_offset_us + round(offset.offset_us)
    told = [offset.text, f"other commands take it as --gyro-offset-us {whole_us}"]
    return gyro.shifted(round(offset.offset_us)), told


def _write_manifest(args: argparse.Namespace, settings: Settings, numbers: dict[str, Any]) -> None:
    """Write what was run, on what and with what result beside the rows."""
    from tiegocancel.report.manifest import input_record, write_manifest

    write_manifest(
        args.out.with_suffix(_MANIFEST),
        command=args.command,
        settings=settings,
        inputs=[input_record(path) for path in _inputs(args, settings)],
        outputs=sorted(Path(path).name for path in numbers["paths"].values()),
        results=numbers,
    )
