"""``tiegocancel budget SOURCE --target NAME|FILE``: does it fit and keep up on this part, and if not, what gives."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from tiegocancel.cli.options import add_reading_options
from tiegocancel.cli.progress import event_progress
from tiegocancel.cli.settings import add_cancel_options, add_estimate_options, add_filter_options, settings_from

if TYPE_CHECKING:
    from tiegocancel.events import Events
    from tiegocancel.files import EventReader
    from tiegocancel.firmware_sim.target import Target
    from tiegocancel.matching.config import CancelConfig
    from tiegocancel.study.budget.judge import Judged
    from tiegocancel.study.settings import Settings

__all__ = ["EXCEEDED", "add_parser", "run"]

EXCEEDED = 3
"""Exit code when a part's budget is exceeded."""

_NUMBERS, _TEXT, _COMPARISON = "budget.json", "budget.txt", "budget.png"
_PLAN_BUDGET = 24


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "budget",
        help="judge parts on a recording: do they fit, do they keep up",
        description="Simulate the canceller on parts, cycle by cycle, on a recording's own timing: memory, logic, "
        "rates, latency, drops, each with its margin, the constraint that binds, and the smallest changes that turn a "
        "fail into a pass with what they cost in cancellation. Without --config, --preset or a flag of the canceller "
        "the operating point is planned for each part. Exit code 3 when a part's budget is exceeded.",
    )
    parser.add_argument("source", type=Path, metavar="SOURCE", help="recording: npz, npy, csv, txt, raw, dat, aedat, …")
    parser.add_argument(
        "--target",
        action="append",
        metavar="NAME|FILE",
        help="part, or a file of your own; may be given again; 'all' is every part (tiegocancel targets lists them)",
    )
    parser.add_argument(
        "--motion", metavar="M", help="fit (default), track, gyro, CX,CY,OMEGA, a CSV or a schedule file"
    )
    group = parser.add_argument_group("budget")
    group.add_argument("--most-events", type=int, metavar="N", help="events simulated, from the beginning (1000000)")
    group.add_argument("--clock-mhz", type=float, metavar="MHZ", help="clock of the core (what the part is known for)")
    group.add_argument(
        "--architecture", choices=("auto", "fixed"), help="simplest that passes (auto), or that of [core] or [mcu]"
    )
    group.add_argument("--readout", type=float, metavar="EV_S", help="events a second that the sensor reads out")
    group.add_argument(
        "--input-link", type=float, metavar="BIT_S", help="line into the part (its fastest link, or any)"
    )
    group.add_argument("--output-link", type=float, metavar="BIT_S", help="line out of the part")
    group.add_argument("--input-bits", type=float, metavar="B", help="bits of an event on the line in (32)")
    group.add_argument("--output-bits", type=float, metavar="B", help="bits of an event on the line out (32)")
    group.add_argument("--external-memory", metavar="NAME|FILE", help="chip that may hold an FPGA's table: hyperram, …")
    group.add_argument("--max-latency-us", type=float, metavar="US", help="latest decision that is soon enough")
    group.add_argument(
        "--no-changes", dest="changes", action="store_false", default=None, help="do not look for changes"
    )
    add_cancel_options(parser)
    add_filter_options(parser)
    add_estimate_options(parser)
    add_reading_options(parser)
    parser.add_argument(
        "--out", type=Path, default=Path("tiegocancel-budget"), metavar="DIR", help="folder for all results"
    )
    parser.add_argument("--no-figures", dest="figures", action="store_false", default=None, help="skip the figures")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML file with every setting; flags override it")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb; return 3 when a part's budget is exceeded."""
    from tiegocancel.errors import ConfigError, InputError
    from tiegocancel.firmware_sim.target import load_target, target_names

    names = args.target or []
    if "all" in names:
        names = list(dict.fromkeys([*target_names(), *(name for name in names if name != "all")]))
    if not names:
        raise ConfigError("--target: name a part or a file; tiegocancel targets lists the parts that are known")
    targets = [load_target(name) for name in names]
    settings = settings_from(args)
    from tiegocancel.cli.outputs import OutputFolder
    from tiegocancel.files import open_events
    from tiegocancel.study.budget.ground import gather
    from tiegocancel.study.budget.judge import judge_target
    from tiegocancel.study.motion_source import motion_inputs, open_motion

    files = [Path(name) for name in names if Path(name).is_file()]
    inputs = [args.source, *motion_inputs(settings), *files, *([] if args.config is None else [args.config])]
    folder = OutputFolder(args.out, inputs, command=args.command, keep_clear=[_NUMBERS, _TEXT, _COMPARISON])
    with open_events(args.source, **asdict(settings.read)) as reader:
        folder.prepare()
        planned = _planned(args, settings, reader, targets)
        found = open_motion(
            settings,
            sample=lambda: _sample(reader, settings),
            width=reader.width,
            height=reader.height,
        )
        ground = gather(
            _chunks(reader, settings),
            found.feed,
            most=settings.budget.most_events,
            step_us=settings.motion.schedule_step_us,
        )
        notes = list(dict.fromkeys(reader.notes))
    if ground is None:
        raise InputError(args.source, "", "holds no events")
    if len(ground.events) == settings.budget.most_events:
        notes.append(f"simulated the first {len(ground.events):,} events only (--most-events)")
    judged = []
    for target in targets:
        cancel, remark = planned.get(target.name, (settings.cancel, None))
        notes += [] if remark is None else [remark]
        with event_progress(f"judging {target.name}", None):
            judged.append(judge_target(ground, target, cancel, settings.core, settings.budget, mcu=settings.mcu))
    for note in notes:
        sys.stderr.write(f"note: {note}\n")
    _write(args, settings, judged, folder, notes)
    return 0 if all(one.verdict.passes for one in judged) else EXCEEDED


def _planned(
    args: argparse.Namespace, settings: Settings, reader: EventReader, targets: list[Target]
) -> dict[str, tuple[CancelConfig, str | None]]:
    """Return the operating point planned for each part, where the user has given none."""
    from tiegocancel.matching.config import CancelConfig
    from tiegocancel.motion.schedule_file import is_schedule_file

    if args.preset is not None or settings.cancel != CancelConfig() or is_schedule_file(settings.motion.source.strip()):
        return {}
    if args.config is not None:
        from tiegocancel.config import load_toml

        if "cancel" in load_toml(args.config):
            return {}
    from tiegocancel.firmware_sim.target_ram import usable_ram_bits
    from tiegocancel.study.plan import PlanConfig, plan_stream
    from tiegocancel.study.plan_result import PlanLimits

    with event_progress("planning an operating point", None) as advance:
        result = plan_stream(
            lambda: _chunks(reader, settings),
            settings,
            PlanConfig(budget=_PLAN_BUDGET),
            width=reader.width,
            height=reader.height,
            progress=advance,
        )
    if result is None or not result.trials:
        return {}
    found: dict[str, tuple[CancelConfig, str | None]] = {}
    for target in targets:
        kib = usable_ram_bits(target) / 8192
        within = replace(result, limits=PlanLimits(target=target.name, target_kib=kib))
        trial = within.smallest or min(result.trials, key=lambda one: one.kib)
        within_words = "within" if within.smallest else "the smallest tried, beyond"
        remark = (
            f"{target.name}: planned {trial.name}, score {trial.score:.3f}, {trial.kib:,.0f} KiB, {within_words} its "
            f"{kib:,.0f} KiB"
        )
        found[target.name] = (trial.config, remark)
    return found


def _chunks(reader: EventReader, settings: Settings) -> Iterable[Events]:
    """Begin the recording anew, behind the filters that are on."""
    from tiegocancel.study.prefilter import Prefilter

    return Prefilter(settings.filter).kept(reader)


def _sample(reader: EventReader, settings: Settings) -> Events:
    """Return the events that a fit may look at: those that are simulated."""
    from tiegocancel.events import Events

    parts, count = [Events.empty(reader.width, reader.height)], 0
    for chunk in _chunks(reader, settings):
        parts.append(chunk[: settings.budget.most_events - count])
        count += len(parts[-1])
        if count >= settings.budget.most_events:
            break
    return Events.concatenate(parts)


def _write(
    args: argparse.Namespace, settings: Settings, judged: list[Judged], folder: object, notes: list[str]
) -> None:
    """Write text, numbers, figures and the manifest; print the text or one JSON object."""
    from tiegocancel.cli.outputs import OutputFolder
    from tiegocancel.study.budget.text import comparison, verdict_text

    assert isinstance(folder, OutputFolder)
    text = "\n".join(verdict_text(one) for one in judged)
    if len(judged) > 1:
        text = comparison(judged) + "\n" + text
    folder.file(_TEXT).write_text(text, encoding="utf-8")
    if settings.output.figures:
        from tiegocancel.report.budget import draw_comparison, draw_part

        draw_comparison(folder.file(_COMPARISON), judged)
        for one in judged:
            draw_part(folder.file(f"budget-{one.verdict.target}.png"), one)
    numbers = {"targets": [one.to_json() for one in judged], "notes": notes, "out": str(folder.path)}
    folder.file(_NUMBERS).write_text(json.dumps(numbers, indent=2) + "\n", encoding="utf-8")
    folder.write_manifest(settings, {"passes": {one.verdict.target: one.verdict.passes for one in judged}})
    if args.json:
        sys.stdout.write(json.dumps(numbers) + "\n")
    else:
        sys.stdout.write(comparison(judged) if len(judged) > 3 else text)
