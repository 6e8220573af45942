"""``tiegocancel plan SOURCE``: search the canceller's parameters for a recording and its motion."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tiegocancel.cli.options import add_reading_options
from tiegocancel.cli.progress import event_progress
from tiegocancel.cli.settings import add_estimate_options, add_filter_options, settings_from

if TYPE_CHECKING:
    from tiegocancel.cli.outputs import OutputFolder
    from tiegocancel.events import Events
    from tiegocancel.files import EventReader
    from tiegocancel.study.plan import PlanConfig
    from tiegocancel.study.plan_result import PlanResult
    from tiegocancel.study.settings import Settings

__all__ = ["add_parser", "run"]

_PLAN, _NUMBERS, _PICTURE = "plan.toml", "plan.json", "pareto.png"


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "plan",
        help="search the canceller's parameters for a recording",
        description="Try operating points of the canceller on the densest stretch of a recording, each with the true "
        "motion, none and reversed motion; draw what they suppress against memory and work, and write the choice as a "
        "configuration that run takes. Where no mover is labelled, a simulated hand is put among the events. The score "
        "is the share of ego events suppressed − max(mover, zero motion, reversed motion).",
    )
    parser.add_argument("source", type=Path, metavar="SOURCE", help="recording: npz, npy, csv, txt, raw, dat, aedat, …")
    parser.add_argument(
        "--motion", metavar="M", help="fit (default), track, gyro, CX,CY,OMEGA in px and rad/s, or a CSV of the motion"
    )
    parser.add_argument("--max-kilobytes", type=float, metavar="K", help="most KiB of ring and table")
    parser.add_argument(
        "--target", metavar="NAME|FILE", help="part whose RAM bounds ring and table (tiegocancel targets lists them)"
    )
    parser.add_argument("--max-loss", type=float, metavar="L", help="most mover events lost, a share")
    parser.add_argument("--max-reads", type=int, metavar="R", help="most table reads an event")
    parser.add_argument("--disc-radius-px", type=float, metavar="PX", help="radius of the disc that turns (guessed)")
    parser.add_argument("--budget", type=int, default=60, metavar="N", help="operating points to try (60)")
    parser.add_argument("--search-seed", type=int, default=0, metavar="N", help="seed of the search (0)")
    parser.add_argument("--refine", action="store_true", help="correct centre and ω by the residuals of a sample")
    parser.add_argument(
        "--motion-interpolation", choices=("file", "linear", "spline", "causal"), help="between the rows of a CSV"
    )
    parser.add_argument("--schedule-step-us", type=int, metavar="US", help="time between schedule entries (1000)")
    parser.add_argument(
        "--out", type=Path, default=Path("tiegocancel-plan"), metavar="DIR", help="folder for all results"
    )
    parser.add_argument("--no-figures", dest="figures", action="store_false", default=None, help="skip the figure")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML file with every setting; flags override it")
    add_filter_options(parser)
    add_estimate_options(parser)
    add_reading_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb; return 1 when no operating point keeps within the limits, 130 when the user ended the search."""
    settings = settings_from(args)
    config = _plan_config(args)
    from tiegocancel.cli.outputs import OutputFolder
    from tiegocancel.errors import InputError
    from tiegocancel.files import open_events
    from tiegocancel.study.motion_source import motion_inputs
    from tiegocancel.study.plan import plan_stream

    inputs = [args.source, *motion_inputs(settings), *([] if args.config is None else [args.config])]
    folder = OutputFolder(args.out, inputs, command=args.command, keep_clear=[_PLAN, _NUMBERS, _PICTURE])
    with open_events(args.source, **asdict(settings.read)) as reader:
        folder.prepare()
        with event_progress("trying operating points", None) as advance:
            result = plan_stream(
                lambda: _chunks(reader, settings),
                settings,
                config,
                width=reader.width,
                height=reader.height,
                progress=advance,
            )
        notes = list(dict.fromkeys(reader.notes))
    if result is None:
        raise InputError(args.source, "", "holds no events")
    flicker = result.flicker_note()
    if result.limits.target is not None:
        notes.append(f"{result.limits.target} offers {result.limits.target_kib:,.0f} KiB of RAM to ring and table")
    notes += [*result.notes, *([] if flicker is None else [flicker])]
    for note in notes:
        sys.stderr.write(f"note: {note}\n")
    _write(args, settings, result, folder, notes)
    if result.interrupted:
        sys.stderr.write("tiegocancel: interrupted; the results are of what was tried until then\n")
        return 130
    if result.chosen is None:
        sys.stderr.write(f"tiegocancel: {_nothing_chosen(result)}\n")
        return 1
    return 0


def _plan_config(args: argparse.Namespace) -> PlanConfig:
    """Return the bounds of the search as the flags give them."""
    from tiegocancel.errors import ConfigError
    from tiegocancel.study.plan import PlanConfig
    from tiegocancel.study.plan_result import PlanLimits

    part: dict[str, Any] = {}
    if args.target is not None:
        from tiegocancel.firmware_sim.target import load_target
        from tiegocancel.firmware_sim.target_ram import usable_ram_bits

        target = load_target(args.target)
        part = {"target": target.name, "target_kib": usable_ram_bits(target) / 8192}
    try:
        limits = PlanLimits(max_kib=args.max_kilobytes, max_loss=args.max_loss, max_reads=args.max_reads, **part)
        return PlanConfig(budget=args.budget, seed=args.search_seed, limits=limits)
    except ValueError as error:
        raise ConfigError(f"plan: {error}") from error


def _chunks(reader: EventReader, settings: Settings) -> Iterable[Events]:
    """Begin the recording anew, behind the filters that are on."""
    from tiegocancel.study.prefilter import Prefilter

    return Prefilter(settings.filter).kept(reader)


def _write(
    args: argparse.Namespace, settings: Settings, result: PlanResult, folder: OutputFolder, notes: list[str]
) -> None:
    """Write the choice, the numbers, the figure and the manifest; print the table or one JSON object."""
    from tiegocancel.study.plan_toml import cancel_toml

    chosen = result.chosen
    if chosen is not None:
        remarks = [
            f"tiegocancel plan {args.source.name}, motion {settings.motion.source}",
            f"ego {chosen.ego:.3f}, mover {chosen.mover:.3f}, zero motion {chosen.zero:.3f}, "
            f"reversed {chosen.reversed:.3f}, {chosen.kib:.0f} KiB, {chosen.reads} table reads an event",
        ]
        folder.file(_PLAN).write_text(cancel_toml(chosen.config, remarks=remarks), encoding="utf-8")
    if settings.output.figures and result.trials:
        from tiegocancel.report.pareto import draw_pareto

        draw_pareto(folder.file(_PICTURE), result)
    numbers = result.to_json() | {"notes": notes, "out": str(folder.path)}
    folder.file(_NUMBERS).write_text(json.dumps(numbers, indent=2) + "\n", encoding="utf-8")
    folder.write_manifest(settings, {name: numbers[name] for name in ("chosen", "smallest", "knee", "notes")})
    if args.json:
        sys.stdout.write(json.dumps(numbers) + "\n")
        return
    sys.stdout.write(result.text())
    if chosen is not None:
        sys.stdout.write(f"plan: {folder.path / _PLAN}\n")


def _nothing_chosen(result: PlanResult) -> str:
    """Say how near the limits anything came."""
    if not result.trials:
        return "no operating point could be tried: the recording is too short for its motion"
    least = min(trial.kib for trial in result.trials)
    loss = min(trial.mover for trial in result.trials)
    reads = min(trial.reads for trial in result.trials)
    return (
        f"none of {len(result.trials)} operating points keeps within the limits; the least that each reached alone: "
        f"{least:.0f} KiB, {loss:.3f} of the mover lost, {reads} reads"
    )
