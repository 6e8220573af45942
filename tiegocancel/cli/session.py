"""Carry one run from events to files on disk: what ``run`` and ``demo`` share."""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tiegocancel.cli.progress import event_progress
from tiegocancel.errors import ConfigError, InputError
from tiegocancel.events import Events
from tiegocancel.files import EventWriter, open_writer
from tiegocancel.motion.fit import RotationFit
from tiegocancel.motion.trajectory import RotationTrajectory
from tiegocancel.study import INTERRUPTED, RunResult, Settings, Verdict, judge, run_stream
from tiegocancel.units import rate_text

__all__ = ["Session"]


class Session:
    """Run the canceller over a stream and write residual, figures, report and manifest into ``args.out``."""

    def __init__(self, args: argparse.Namespace, settings: Settings, *, title: str, inputs: list[Path]) -> None:
        self.args, self.settings, self.title, self.inputs = args, settings, title, inputs
        self.out: Path = args.out

    def run(
        self,
        chunks: Iterable[Events],
        trajectory: RotationTrajectory,
        *,
        width: int,
        height: int,
        notes: list[str],
        labelled: bool,
        fit: RotationFit | None = None,
        disc_radius_px: float | None = None,
        expected_us: int | None = None,
        photograph: NDArray[np.float32] | None = None,
    ) -> int:
        """Return the exit code: 1 when the input ended in a fault, 130 when the user ended it.

        What came before that is on disk in either case.
        """
        self._make_folder()
        with self._residual(width, height, labelled) as sink, event_progress("cancelling", expected_us) as advance:
            result = run_stream(
                chunks,
                self.settings,
                trajectory,
                width=width,
                height=height,
                sink=sink,
                disc_radius_px=disc_radius_px,
                expected_us=expected_us,
                progress=advance,
            )
        for note in [*notes, *trajectory.notes]:
            sys.stderr.write(f"note: {note}\n")
        if result is None:
            raise InputError(str(self.inputs[0]) if self.inputs else self.title, "", "holds no events")
        for note in result.notes:
            sys.stderr.write(f"note: {note}\n")
        verdict = judge(result)
        self._write(result, verdict, fit, notes, photograph)
        if result.fault is not None:
            sys.stderr.write(f"tiegocancel: {result.fault}\n")
            return 130 if result.fault == INTERRUPTED else 1
        return 0

    def _make_folder(self) -> None:
        try:
            self.out.mkdir(parents=True, exist_ok=True)
        except (FileExistsError, NotADirectoryError) as error:
            raise ConfigError(f"--out {self.out}: a file of that name is in the way") from error

    @contextlib.contextmanager
    def _residual(self, width: int, height: int, labelled: bool) -> Iterator[EventWriter | None]:
        """Open the writer of residual events, if they are wanted."""
        format = self.settings.output.residual
        if format == "none":
            yield None
            return
        suffix = {"evt2": "raw"}.get(format, format)
        path = self.out / f"residual.{suffix}"
        with open_writer(path, width=width, height=height, labelled=labelled, format=format) as writer:
            yield writer

    def _write(
        self,
        result: RunResult,
        verdict: Verdict,
        fit: RotationFit | None,
        notes: list[str],
        photograph: NDArray[np.float32] | None,
    ) -> None:
        """Write figures, report and manifest; print the numbers."""
        from tiegocancel.report import draw_figures, write_manifest, write_page

        with event_progress("drawing", None):
            drawings = draw_figures(result, self.out, photograph) if self.settings.output.figures else []
        page = self.out / "report.html"
        write_page(page, result, verdict, drawings, title=self.title, notes=notes)
        numbers = result.to_json()
        numbers["verdict"] = {"grade": verdict.grade, "headline": verdict.headline, "reasons": list(verdict.reasons)}
        numbers["notes"] = [*notes, *result.trajectory.notes, *numbers["notes"]]
        if fit is not None:
            numbers["motion"] |= {"confident": fit.confident, "contrast_gain": fit.contrast_gain}
        write_manifest(
            self.out / "manifest.json",
            command=["tiegocancel", *sys.argv[1:]],
            settings=self.settings,
            inputs=self.inputs,
            outputs=sorted(path for path in self.out.iterdir() if path.name != "manifest.json"),
            results=numbers,
        )
        if self.args.json:
            sys.stdout.write(json.dumps(numbers, ensure_ascii=False) + "\n")
        else:
            sys.stdout.write(_summary(result, verdict) + f"report: {page}\n")


def _summary(result: RunResult, verdict: Verdict) -> str:
    """Say the main numbers in a few lines."""
    share, disc = result.tally.share(), result.tally.share(on_disc=True)
    lines = [
        verdict.headline,
        f"  events       {result.counters.events:,} in {result.duration_s:.3f} s, "
        f"{result.counters.suppressed:,} suppressed",
        f"  motion       centre ({result.region.center_px[0]:.1f}, {result.region.center_px[1]:.1f}) px, "
        f"ω {result.omega_rad_s:+.4f} rad/s ({result.trajectory.source})",
        f"  {'':22}all      disc",
        f"  {'cancellation ratio':20}{share.ratio:6.1%}    {disc.ratio:6.1%}",
    ]
    for name, tally in result.controls.items():
        whole, inside = tally.share().ratio, tally.share(on_disc=True).ratio
        lines.append(f"  {name.replace('_', ' '):20}{whole:6.1%}    {inside:6.1%}")
    selectivity = result.tally.selectivity()
    if selectivity is not None:
        lines.append(
            f"  by label     ego {selectivity['ego']:.1%}, mover {selectivity['mover']:.1%}, "
            f"noise {selectivity['noise']:.1%}: J = {selectivity['j']:.3f}"
        )
    rate_hz = result.counters.events / result.seconds if result.seconds else 0.0
    lines.append(f"  speed        {rate_text(rate_hz)}; state {result.state.total_kib:,.0f} KiB")
    return "\n".join(lines) + "\n"
