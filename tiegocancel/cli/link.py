"""``tiegocancel link SOURCE``: what a recording asks of a line, before and after cancellation, in bits."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tiegocancel.cli.link_options import add_protocol_options, protocol_from
from tiegocancel.cli.options import add_reading_options
from tiegocancel.cli.progress import event_progress
from tiegocancel.cli.settings import add_cancel_options, add_estimate_options, add_filter_options, settings_from

if TYPE_CHECKING:
    from tiegocancel.events import Events
    from tiegocancel.link.budget import LinkBudget, WireMeter

__all__ = ["add_parser", "run"]


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "link",
        help="what a recording asks of a line, before and after cancellation",
        description="Measure the bytes of a recording in a wire protocol before and after cancellation, and what they "
        "ask of a line: bits a second, utilisation, the queue needed, the loss at a given FIFO.",
    )
    parser.add_argument("source", type=Path, metavar="SOURCE", help="recording: npz, npy, csv, txt, raw, dat, aedat, …")
    parser.add_argument("--motion", metavar="M", help="as for run: fit (default), track, gyro, CX,CY,OMEGA, a file")
    group = add_protocol_options(parser, required=True)
    group.add_argument("--fifo", type=int, default=4096, metavar="BYTES", help="FIFO before the line (4096)")
    add_cancel_options(parser)
    add_filter_options(parser)
    add_estimate_options(parser)
    add_reading_options(parser)
    output = parser.add_argument_group("output")
    output.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    output.add_argument("--figure", type=Path, metavar="FILE", help="draw the demand against time: .png, .svg or .pdf")
    output.add_argument("--disc-radius-px", type=float, metavar="PX", help="radius of the disc that turns (guessed)")
    output.add_argument("--config", type=Path, metavar="FILE", help="TOML file with every setting; flags override it")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    settings = settings_from(args)
    from tiegocancel.cli.run import sample_of
    from tiegocancel.errors import ConfigError, InputError
    from tiegocancel.files import open_events
    from tiegocancel.link.budget import WireMeter
    from tiegocancel.link.line_options import LineOptions
    from tiegocancel.link.protocols import registry
    from tiegocancel.study import judge, run_stream
    from tiegocancel.study.motion_source import open_motion

    settings = replace(settings, report=replace(settings.report, diagnose=False))
    rate = LineOptions(baud=args.baud).bytes_per_s
    if args.fifo < 1:
        raise ConfigError(f"--fifo must be at least 1 byte, not {args.fifo}")
    with open_events(args.source, **asdict(settings.read)) as reader:
        options = replace(protocol_from(args), width=reader.width, height=reader.height)
        before, after = (WireMeter(registry.encoder(args.protocol, options), rate, args.fifo) for _ in range(2))
        with event_progress("finding the motion", None) as advance:
            found = open_motion(
                settings, sample=lambda: sample_of(reader, settings, advance), width=reader.width, height=reader.height
            )
        with event_progress("measuring", None) as advance:

            def passed(chunk: Events) -> None:
                before.write(chunk)
                advance(chunk)

            result = run_stream(reader, settings, found.feed, sink=after, progress=passed)
        notes = list(reader.notes)
    if result is None:
        raise InputError(args.source, "", "holds no events")
    verdict = judge(result)
    span_us = result.last_us - result.first_us
    budgets = {"before": before.meter.budget(span_us), "after": after.meter.budget(span_us)}
    for note in [*notes, *result.notes]:
        sys.stderr.write(f"note: {note}\n")
    if args.figure is not None:
        _draw(args.figure, before, after, rate)
    numbers = {
        "protocol": args.protocol,
        "baud": args.baud,
        **{name: budget.to_json() for name, budget in budgets.items()},
        "bits_saved": 1.0 - budgets["after"].bytes / max(budgets["before"].bytes, 1),
        "cancellation_ratio": result.tally.share().ratio,
        "controls": {name: tally.share().ratio for name, tally in result.controls.items()},
        "verdict": verdict.grade,
        "fault": result.fault,
    }
    if args.json:
        sys.stdout.write(json.dumps(numbers) + "\n")
    else:
        sys.stdout.write(_text(numbers, budgets, verdict.headline))
    if result.fault is not None:
        sys.stderr.write(f"tiegocancel: {result.fault}\n")
    return 0 if result.fault is None else 1


def _draw(path: Path, before: WireMeter, after: WireMeter, rate: float) -> None:
    """Write the figure; that of the residual begins where the stream does."""
    import numpy as np

    from tiegocancel.errors import ConfigError
    from tiegocancel.report.link import link_figure

    lead = 0
    if before.first_us is not None and after.first_us is not None:
        lead = (after.first_us - before.first_us) // 1000
    profile = np.concatenate([np.zeros(lead), after.meter.profile()])
    try:
        link_figure(before.meter.profile(), profile, rate).savefig(path, dpi=150)
    except (OSError, ValueError) as error:
        raise ConfigError(f"--figure {path}: cannot be written: {error}") from None


def _text(numbers: dict[str, Any], budgets: dict[str, LinkBudget], headline: str) -> str:
    """Say the budgets side by side, and what the saving rests on."""
    rows = (
        ("events", "{0.events:,}"),
        ("bytes", "{0.bytes:,}"),
        ("bytes an event", "{0.bytes_per_event:.2f}"),
        ("kbit/s", "{1:,.1f}"),
        ("utilisation, mean", "{0.utilisation:.1%}"),
        ("  most of 10 ms", "{0.peak_10ms:.1%}"),
        ("  most of 1 ms", "{0.peak_1ms:.1%}"),
        ("queue needed (bytes)", "{0.queue_bytes:,}"),
        ("  its delay (ms)", "{2:,.2f}"),
        ("lost at the FIFO", "{0.lost_share:.2%}"),
    )
    first = budgets["before"]
    lines = [
        headline,
        f"  {numbers['protocol']} at {numbers['baud']:,} baud: {first.line_bytes_per_s:,.0f} bytes/s, FIFO of "
        f"{first.fifo_bytes:,} bytes",
        f"  {'':22}{'before':>14}{'after':>14}",
    ]
    for name, form in rows:
        cells = [form.format(b, 8e-3 * b.bytes_per_s, 1e3 * b.delay_s) for b in budgets.values()]
        lines.append(f"  {name:22}{cells[0]:>14}{cells[1]:>14}")
    controls = ", ".join(f"{name.replace('_', ' ')} {ratio:.1%}" for name, ratio in numbers["controls"].items())
    lines.append(f"  bits saved  {numbers['bits_saved']:.1%}; events {numbers['cancellation_ratio']:.1%} ({controls})")
    return "\n".join(lines) + "\n"
