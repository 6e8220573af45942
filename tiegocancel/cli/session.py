"""Carry one run from events, of a recording or a link, to files on disk: what ``run`` and ``demo`` share."""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.cli.outputs import OutputFolder
from tiegocancel.cli.progress import event_progress
from tiegocancel.cli.summary import link_text, summary_text
from tiegocancel.errors import InputError
from tiegocancel.estimation.contrast.fit import RotationFit
from tiegocancel.events import Events
from tiegocancel.files import EventWriter, open_writer
from tiegocancel.link.device_loop import DeviceLoop
from tiegocancel.link.source import LinkSource
from tiegocancel.matching.canceller import Decisions
from tiegocancel.study import INTERRUPTED, RunResult, Settings, Verdict, judge, run_stream
from tiegocancel.study.feed import MotionFeed, TrackedMotion
from tiegocancel.study.live import LiveSource, Watcher, run_live
from tiegocancel.study.motion_source import Found
from tiegocancel.study.one_pass import OnePass

__all__ = ["Session"]


class Session:
    """Run the canceller over a stream and write residual, figures, report and manifest into ``args.out``."""

    def __init__(self, args: argparse.Namespace, settings: Settings, *, title: str, inputs: list[Path]) -> None:
        self.args, self.settings, self.title = args, settings, title
        format = settings.output.residual
        self.residual = None if format == "none" else f"residual.{'raw' if format == 'evt2' else format}"
        clear = [] if self.residual is None else [self.residual]
        self.folder = OutputFolder(args.out, inputs, command=args.command, keep_clear=clear)

    def run(
        self,
        chunks: Iterable[Events],
        found: Found,
        *,
        width: int,
        height: int,
        notes: list[str],
        labelled: bool,
        disc_radius_px: float | None = None,
        expected_us: int | None = None,
        photograph: NDArray[np.float32] | None = None,
    ) -> int:
        """Return the exit code: 1 when the input ended in a fault, 130 when the user ended it.

        What came before that is on disk in either case.
        """
        self.folder.prepare()
        with (
            self._residual_writer(width, height, labelled) as sink,
            self._estimate_writer(found.feed),
            event_progress("cancelling", expected_us) as advance,
        ):
            result = run_stream(
                chunks,
                self.settings,
                found.feed,
                sink=sink,
                disc_radius_px=disc_radius_px,
                expected_us=expected_us,
                progress=advance,
            )
        return self._finish(result, found, sink, notes, photograph=photograph)

    def run_link(
        self,
        link: LinkSource,
        found: Found,
        *,
        width: int,
        height: int,
        sinks: Sequence[Callable[[Events], None]] = (),
        watch: Watcher | None = None,
        more_notes: Callable[[], list[str]] = list,
    ) -> int:
        """Run over a live link; ``sinks`` take the residual of each chunk too. Return the exit code as :meth:`run`."""
        self.folder.prepare()
        with (
            self._residual_writer(width, height, False) as sink,
            self._estimate_writer(found.feed),
            event_progress("cancelling", None) if watch is None else contextlib.nullcontext() as advance,
        ):

            def count(events: Events, decisions: Decisions | None, run: OnePass | None) -> None:
                if advance is not None and len(events):
                    advance(events)

            every = [*([] if sink is None else [sink.write]), *sinks]

            def hand_on(residual: Events) -> None:
                for take in every:
                    take(residual)

            result = run_live(link, self.settings, found.feed, sink=hand_on, watch=watch or count)
            # What the device's end and the thread's have to say belongs into the report.
            link.close()
        return self._finish(result, found, sink, [*link.notes(), *more_notes()], link=link.to_json())

    def run_with_device(
        self,
        source: LiveSource,
        found: Found,
        device: DeviceLoop,
        *,
        width: int,
        height: int,
        notes: list[str],
    ) -> int:
        """Run while a device decides the same events and is compared; return the exit code as :meth:`run`."""
        self.folder.prepare()

        def compare(events: Events, decisions: Decisions | None, run: OnePass | None) -> None:
            if decisions is not None:
                device.exchange(events, decisions.suppressed)

        with self._residual_writer(width, height, False) as sink:
            hand_on = None if sink is None else sink.write
            result = run_live(source, self.settings, found.feed, sink=hand_on, watch=compare)
        return self._finish(result, found, sink, notes, device=device.to_json())

    def _finish(
        self,
        result: RunResult | None,
        found: Found,
        sink: EventWriter | None,
        notes: list[str],
        *,
        photograph: NDArray[np.float32] | None = None,
        **extra: dict[str, Any],
    ) -> int:
        """Say what there is to say, write numbers, figures and report, and return the exit code."""
        if sink is not None:
            notes = [*notes, *sink.notes]
        notes += [f"refining: {diagnosis.text}" for diagnosis in found.diagnoses]
        said = () if result is None else (*result.trajectory.notes, *result.notes)
        for note in [*notes, *said]:
            sys.stderr.write(f"note: {note}\n")
        if result is None:
            raise InputError(self.title, "", "holds no events")
        self._write(result, judge(result), found.fit, notes, photograph, extra)
        if result.fault is None:
            return 0
        sys.stderr.write(f"tiegocancel: {result.fault}\n")
        return 130 if result.fault == INTERRUPTED else 1

    @contextlib.contextmanager
    def _residual_writer(self, width: int, height: int, labelled: bool) -> Iterator[EventWriter | None]:
        """Open the writer of residual events, if they are wanted."""
        if self.residual is None:
            yield None
            return
        path = self.folder.file(self.residual)
        format = self.settings.output.residual
        with open_writer(path, width=width, height=height, labelled=labelled, format=format) as writer:
            yield writer
        sidecar = path.with_name(path.name + ".labels.npy")
        if sidecar.exists():
            self.folder.file(sidecar.name)

    @contextlib.contextmanager
    def _estimate_writer(self, feed: MotionFeed) -> Iterator[None]:
        """Write the rows of a motion that is found on the way, as they come."""
        if not isinstance(feed, TrackedMotion):
            yield
            return
        from tiegocancel.estimation.estimates_csv import EstimateWriter

        with EstimateWriter(self.folder.file("motion.csv")) as writer:
            feed.sink = writer.extend
            yield

    def _write(
        self,
        result: RunResult,
        verdict: Verdict,
        fit: RotationFit | None,
        notes: list[str],
        photograph: NDArray[np.float32] | None,
        extra: dict[str, dict[str, Any]],
    ) -> None:
        """Print the numbers, write the manifest, then figures and report: numbers first, in case drawing is cut."""
        from tiegocancel.report import draw_figures, write_page

        numbers = result.to_json()
        numbers["verdict"] = {"grade": verdict.grade, "headline": verdict.headline, "reasons": list(verdict.reasons)}
        numbers["notes"] = [*notes, *result.trajectory.notes, *numbers["notes"]]
        numbers |= extra
        if fit is not None:
            numbers["motion"] |= {"confident": fit.confident, "contrast_gain": fit.contrast_gain}
        self.folder.write_manifest(self.settings, numbers)
        with event_progress("drawing", None):
            wanted = self.settings.output.figures
            drawings = draw_figures(result, self.folder.path, photograph) if wanted else []
        for drawing in drawings:
            self.folder.file(drawing.path.name)
        page = self.folder.file("report.html")
        write_page(page, result, verdict, drawings, title=self.title, notes=notes)
        self.folder.write_manifest(self.settings, numbers)
        if self.args.json:
            sys.stdout.write(json.dumps(numbers) + "\n")
        else:
            # Standard output may carry the residual events.
            talk = sys.stderr if getattr(self.args, "residual_to", None) == "-" else sys.stdout
            said = link_text(extra["link"]) if "link" in extra else ""
            talk.write(summary_text(result, verdict) + said + f"report: {page}\n")
