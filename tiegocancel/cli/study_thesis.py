"""``tiegocancel study-thesis [SOURCE]``: rerun the thesis's experiments with the controls that it lacks."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tiegocancel.cli.options import add_reading_options
from tiegocancel.cli.settings import add_estimate_options, settings_from
from tiegocancel.cli.sweep_progress import sweep_progress

if TYPE_CHECKING:
    from tiegocancel.cli.outputs import OutputFolder
    from tiegocancel.events import Events
    from tiegocancel.motion.rotation import RotationTrajectory
    from tiegocancel.study.settings import Settings
    from tiegocancel.study.thesis.finding import Finding
    from tiegocancel.study.thesis.settings import ThesisSettings
    from tiegocancel.study.thesis.study import ThesisResult
    from tiegocancel.study.thesis.windows import Window

__all__ = ["add_parser", "run"]

_DEFAULTS: dict[str, dict[str, Any]] = {"simulate": {"duration_s": 1.0, "seed": 1}}
_STORE, _PAGE, _SUMMARY, _NUMBERS = "results.jsonl", "report.html", "summary.csv", "summary.json"


@dataclass(frozen=True, slots=True)
class _Everything:
    """The settings of a run and the study's own, for the manifest."""

    run: Settings
    thesis: ThesisSettings


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "study-thesis",
        help="rerun the thesis's experiments, with controls",
        description="Rerun every experiment, table and figure of the thesis on a recording or on the built-in disc: as "
        "printed, with its artefacts taken away one by one, under zero and reversed motion, and on the streaming "
        "canceller; write a page that leads with the thesis's figures beside ours. A run that is broken off goes on "
        "where it was when it is started again with the same --out.",
    )
    parser.add_argument("source", type=Path, nargs="?", metavar="SOURCE", help="recording (the built-in disc)")
    parser.add_argument(
        "--motion", metavar="M", help="fit (default of a recording), CX,CY,OMEGA in px and rad/s, or a tracker's CSV"
    )
    parser.add_argument("--quick", action="store_true", help="two windows and coarse grids: a look, not a study")
    parser.add_argument("--duration", type=float, metavar="S", help="seconds of the built-in disc (1)")
    parser.add_argument("--seed", type=int, metavar="N", help="seed of the built-in disc's sensor (1)")
    parser.add_argument("--disc-radius-px", type=float, metavar="PX", help="radius of the disc that turns (guessed)")
    parser.add_argument("--engine", choices=("inline", "processes"), help="where jobs run (processes)")
    parser.add_argument("--workers", type=int, metavar="N", help="processes (one a core)")
    parser.add_argument("--cluster", metavar="ADDRESS", help="scheduler of a Dask cluster: tcp://host:8786")
    parser.add_argument(
        "--out", type=Path, default=Path("tiegocancel-thesis"), metavar="DIR", help="folder for all results"
    )
    parser.add_argument("--no-figures", dest="figures", action="store_false", default=None, help="skip the figures")
    parser.add_argument("--no-video", action="store_true", help="skip the high-pass video")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML file; the study's own tables are [thesis.…]")
    add_estimate_options(parser)
    add_reading_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb; return 130 when the user ended the sweep."""
    settings = settings_from(args, _DEFAULTS, aside=("thesis",))
    thesis = _thesis_settings(args)
    from tiegocancel.cli.outputs import OutputFolder
    from tiegocancel.study.motion_source import motion_inputs
    from tiegocancel.study.thesis.study import run_study
    from tiegocancel.study.thesis.windows import cut_windows

    inputs = [path for path in (args.source, args.config, *motion_inputs(settings)) if path is not None]
    folder = OutputFolder(args.out, inputs, command=args.command, keep_clear=[_STORE, _SUMMARY, _NUMBERS])
    chunks, read_notes = _stream(args, settings)
    windows, notes = cut_windows(chunks, thesis.windows, thesis.longest_us)
    if not windows:
        from tiegocancel.errors import InputError

        raise InputError(args.source or "built-in disc", "", notes[0] if notes else "holds no events")
    bench = _bench(args, settings, windows)
    folder.prepare()
    with sweep_progress("measuring") as advance:
        result = run_study(bench, thesis, folder.path / _STORE, progress=advance)
    notes = [*notes, *bench.motion.notes, *read_notes]
    for note in notes:
        sys.stderr.write(f"note: {note}\n")
    if result.interrupted:
        sys.stderr.write(f"tiegocancel: interrupted; the same command goes on from {folder.path / _STORE}\n")
        return 130
    from tiegocancel.study.thesis.summary import summarise

    findings = summarise(result)
    film = _film(chunks, result, folder, notes) if thesis.video.enabled else None
    _write(args, settings, result, findings, folder, notes, film)
    return 0


def _thesis_settings(args: argparse.Namespace) -> ThesisSettings:
    """Return the tables below ``[thesis]``, with the flags on them."""
    from tiegocancel.config import fill, load_toml
    from tiegocancel.errors import ConfigError
    from tiegocancel.study.thesis.settings import ThesisSettings

    table = load_toml(args.config).get("thesis", {}) if args.config is not None else {}
    if not isinstance(table, dict):
        raise ConfigError(f"{args.config}: thesis must be a table ([thesis]), not {table!r}")
    flags = {"kind": args.engine, "workers": args.workers, "address": args.cluster}
    if args.cluster is not None:
        if args.engine is not None:
            raise ConfigError(f"--engine {args.engine}: --cluster says where jobs run")
        flags["kind"] = "cluster"
    given = {name: value for name, value in flags.items() if value is not None}
    if given:
        engine = table.get("engine", {})
        table = {**table, "engine": {**(engine if isinstance(engine, dict) else {}), **given}}
    settings = fill(ThesisSettings, table, "flags" if args.config is None else f"{args.config} [thesis]")
    if args.no_video:
        settings = replace(settings, video=replace(settings.video, enabled=False))
    return settings.quick() if args.quick else settings


def _stream(args: argparse.Namespace, settings: Settings) -> tuple[Callable[[], Iterable[Events]], list[str]]:
    """Return a function that begins the stream anew, and the notes that reading it makes."""
    if args.source is None:
        from tiegocancel.scene import simulate

        parts = list(simulate(settings.scene, duration_s=settings.simulate.duration_s, seed=settings.simulate.seed))
        return (lambda: parts), []
    from tiegocancel.files import open_events

    notes: list[str] = []

    def begin() -> Iterable[Events]:
        with open_events(args.source, **asdict(settings.read)) as reader:
            yield from reader
            notes[:] = reader.notes

    return begin, notes


def _bench(args: argparse.Namespace, settings: Settings, windows: tuple[Window, ...]) -> Any:
    """Return what all points share: the windows, the motion, the disc."""
    from tiegocancel.metrics import estimate_radius_px
    from tiegocancel.study.thesis.probe import Bench

    motion = _motion(args, settings, windows)
    center_px, _ = motion.mean(start_us=windows[0].start_us, stop_us=windows[-1].stop_us)
    radius_px = settings.report.disc_radius_px
    if radius_px is None and args.source is None:
        radius_px = settings.scene.rig.radius_px
    if radius_px is None:
        radius_px, seen = estimate_radius_px(windows[0].isolated, center_px)
        if not seen:
            motion = motion.noted("no edge of a disc was seen: its radius is that of 99 % of the events")
    return Bench(windows, motion, center_px, radius_px, settings.motion.schedule_step_us)


def _motion(args: argparse.Namespace, settings: Settings, windows: tuple[Window, ...]) -> RotationTrajectory:
    """Return the rotation; raise ``ConfigError`` for a motion that is none or is found on the way."""
    from tiegocancel.errors import ConfigError
    from tiegocancel.motion.rotation import RotationTrajectory
    from tiegocancel.study.feed import FixedMotion
    from tiegocancel.study.motion_source import open_motion

    if args.source is None and args.motion is None:
        from tiegocancel.scene import ground_truth

        return ground_truth(settings.scene, duration_s=settings.simulate.duration_s)
    first = windows[0].events
    feed = open_motion(settings, sample=lambda: first, width=first.width, height=first.height).feed
    if not isinstance(feed, FixedMotion) or not isinstance(feed.trajectory, RotationTrajectory):
        raise ConfigError(
            f"--motion {settings.motion.source}: the thesis knows one rotation: fit, CX,CY,OMEGA or a CSV of its rows"
        )
    return feed.trajectory


def _film(
    chunks: Callable[[], Iterable[Events]], result: ThesisResult, folder: OutputFolder, notes: list[str]
) -> tuple[Path, str] | None:
    """Write the high-pass video from the first window on; return it and how it was made, or note why there is none."""
    from tiegocancel.report.thesis.video import write_video
    from tiegocancel.study.thesis.film import film_of

    film = film_of(chunks, result)
    fps = result.settings.video.fps
    path = write_video(folder.path, "high_pass", film.events, film.suppressed, frame_us=film.frame_us, fps=fps)
    if path is None:
        notes.append("no video: the warm-up leaves nothing of the recording to show")
        sys.stderr.write(f"note: {notes[-1]}\n")
        return None
    return folder.file(path.name), f"Δt = {film.horizon_us / 1000:g} ms, frames of {film.frame_us / 1000:g} ms; "


def _write(
    args: argparse.Namespace,
    settings: Settings,
    result: ThesisResult,
    findings: list[Finding],
    folder: OutputFolder,
    notes: list[str],
    film: tuple[Path, str] | None,
) -> None:
    """Write tables, figures, page and manifest; print the summary or one JSON object."""
    from tiegocancel.report.thesis.page import write_summary_csv, write_thesis_page
    from tiegocancel.study.sweep import write_table

    rows = result.results.rows
    for path in write_table(folder.path, "results", [point.job() for point in rows], list(rows.values())):
        folder.file(path.name)
    agreed = write_table(
        folder.path, "agreement", [point.job() for point, _ in result.agreement], [row for _, row in result.agreement]
    )
    for path in agreed:
        folder.file(path.name)
    write_summary_csv(folder.file(_SUMMARY), findings)
    drawings = []
    if settings.output.figures:
        from tiegocancel.report.thesis.figures import draw_thesis_figures

        drawings = draw_thesis_figures(result, folder.path)
        for drawing in drawings:
            folder.file(drawing.path.name)
    title = "The thesis, rerun: " + ("built-in disc" if args.source is None else args.source.name)
    video, words = film or (None, "")
    write_thesis_page(
        folder.file(_PAGE), result, findings, drawings, title=title, notes=notes, video=video, video_words=words
    )
    numbers = {
        "findings": [asdict(finding) for finding in findings],
        "comparisons": [asdict(comparison) for comparison in result.comparisons],
        "agreement": [point.job() | row for point, row in result.agreement],
        "points": {"resumed": result.resumed, "run": result.run},
        "notes": notes,
        "out": str(folder.path),
    }
    folder.file(_NUMBERS).write_text(json.dumps(numbers, indent=2) + "\n", encoding="utf-8")
    folder.write_manifest(_Everything(settings, result.settings), numbers)
    if args.json:
        sys.stdout.write(json.dumps(numbers) + "\n")
        return
    for finding in findings:
        sys.stdout.write(f"{finding.what} ({finding.where}): thesis {finding.thesis}. {finding.verdict}\n")
    sys.stdout.write(f"report: {folder.path / _PAGE}\n")
