"""Write the thesis's page: the summary first, then every figure."""

from __future__ import annotations

import base64
import csv
import re
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from pathlib import Path

from tiegocancel.report.figures import Drawing
from tiegocancel.study.thesis.claims import SLIPS
from tiegocancel.study.thesis.columns import COLUMNS
from tiegocancel.study.thesis.compensation import Comparison
from tiegocancel.study.thesis.finding import Finding
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["write_summary_csv", "write_thesis_page"]


def write_summary_csv(path: Path, findings: Sequence[Finding]) -> None:
    """Write the summary as a table."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["where", "what", "thesis", *COLUMNS.values(), "verdict"])
        for line in findings:
            ours = [line.ours.get(name) for name in COLUMNS]
            writer.writerow([line.where, line.what, line.thesis, *ours, line.verdict])


def write_thesis_page(
    path: Path,
    result: ThesisResult,
    findings: Sequence[Finding],
    drawings: Sequence[Drawing],
    *,
    title: str,
    notes: Sequence[str],
    video: Path | None = None,
    video_words: str = "",
) -> None:
    """Write one self-contained HTML page; figures are embedded, a GIF too, an MP4 is named.

    ``video_words`` say how the video was made.
    """
    sheet = re.search(r"<style>.*</style>", _template(), re.DOTALL)
    assert sheet is not None  # the page of a run carries the style of both
    body = [
        f"<header><h1>{escape(title)}</h1><p>{escape(_subtitle(result))}</p></header>",
        _lead(result),
        _summary(findings),
        _slips(),
        _compensation(result.comparisons),
        _remarks(notes),
        *(_figure(drawing) for drawing in drawings),
        _film(video, video_words),
        "<footer>Written by tiegocancel. results.csv beside this page holds every measured point, summary.csv the "
        "table above, manifest.json the configuration and the inputs’ checksums.</footer>",
    ]
    page = (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)} · tiegocancel</title>'
        f"{sheet.group(0)}<style>main {{ max-width: 1240px; }} .wide tbody th {{ min-width: 120px; }}"
        ".wide td, .wide th { font-size: 12.5px; } .wide th { color: var(--ink); } "
        ".wide td.verdict-cell { min-width: 260px; }</style></head>"
        f"<body><main>{''.join(body)}</main></body></html>\n"
    )
    path.write_text(page, encoding="utf-8", errors="backslashreplace")


def _template() -> str:
    return files("tiegocancel.report").joinpath("page.html").read_text(encoding="utf-8")


def _subtitle(result: ThesisResult) -> str:
    windows = result.bench.windows
    events = sum(len(window.isolated) for window in windows)
    start_us, stop_us = windows[0].start_us, windows[-1].stop_us
    return (
        f"{len(windows)} window(s) of {(windows[0].stop_us - windows[0].start_us) / 1000:g} ms, {events:,} events of "
        f"{windows[0].events.width}×{windows[0].events.height} px; "
        f"{result.bench.motion.described(start_us=start_us, stop_us=stop_us)}; disc radius "
        f"{result.bench.radius_px:g} px; {result.resumed + result.run:,} points measured"
    )


def _lead(result: ThesisResult) -> str:
    """Say in words how to read the columns."""
    return (
        "<section class='card'><h2>How to read this</h2><p>Every ratio of the thesis is measured in steps, each of "
        "which takes one artefact away: <b>as printed</b>, Algorithm 1 on windows that are cut out of the recording; "
        "<b>own off</b>, no event may meet its own prediction; <b>(4.4), pairs</b>, the text's symmetric gate with "
        "both events of a pair counted, windows cut out; <b>(4.4), own off, no warm-up</b>, the same gate one count "
        "an event, led in by what comes before the window, or else without the warm-up; <b>zero motion</b>, that "
        "again while being told that nothing moves; <b>reversed</b>, that it turns the other way; <b>streaming</b>, "
        "the canceller of this package. A ratio that zero motion reaches too shows no prediction at work.</p></section>"
    )


def _summary(findings: Sequence[Finding]) -> str:
    heads = "".join(f"<th>{escape(head)}</th>" for head in ("", "thesis", *COLUMNS.values(), "verdict"))
    rows = []
    for line in findings:
        cells = "".join(f"<td>{_number(line.ours.get(name) or '–')}</td>" for name in COLUMNS)
        rows.append(
            f"<tr><th>{_number(line.what)}<br><span class='meaning'>{escape(line.where)}</span></th>"
            f"<td>{_number(line.thesis)}</td>{cells}<td class='verdict-cell'>{_number(line.verdict)}</td></tr>"
        )
    return (
        "<section class='card'><h2>The thesis’s figures and ours</h2><table class='wide'><thead><tr>"
        f"{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table></section>"
    )


def _number(text: str) -> str:
    """Escape a cell whose numbers stay with their units on one line."""
    return re.sub(r"(?<=\d) (?=%|ms|px|s\b|rad/s|points)", "&nbsp;", escape(text))


def _slips() -> str:
    rows = "".join(
        f"<tr><th>{escape(slip.where)}</th><td>{escape(slip.says)}</td><td>{escape(slip.follows)}</td></tr>"
        for slip in SLIPS
    )
    return (
        "<section class='card'><h2>Units and values that contradict each other</h2><table class='wide'><thead><tr>"
        f"<th></th><th>the thesis says</th><th>but</th></tr></thead><tbody>{rows}</tbody></table></section>"
    )


def _compensation(comparisons: Sequence[Comparison]) -> str:
    """Show what both methods did to each window."""
    if not comparisons:
        return ""
    heads = (
        "window", "told", "events", "Δt", "variance, warped", "variance, residual", "gradient, warped",
        "gradient, residual", "sent on", "fit", "warp", "streaming", "ω of the fit",
    )  # fmt: skip
    rows = []
    for one in comparisons:
        omega = "not confident" if one.fit_omega_rad_s is None else f"{one.fit_omega_rad_s:.3f} rad/s"
        seconds = (f"{one.fit_s:.2f} s", f"{1000 * one.warp_s:.1f} ms", f"{1000 * one.cancel_s:.1f} ms", omega)
        for told, warped, residual, suppressed, rest in (
            ("the motion", "warped", "residual", one.suppressed, seconds),
            ("zero motion", "original", "residual_zero", one.suppressed_zero, ("",) * 4),
            ("reversed", "warped_reversed", "residual_reversed", one.suppressed_reversed, ("",) * 4),
        ):
            lead = (one.window, told, f"{one.events:,}", f"{one.horizon_us / 1000:g} ms")
            sharp = (f"×{values[name]:.2f}" for values in (one.variance, one.gradient) for name in (warped, residual))
            cells = (*lead, *sharp, f"{1 - suppressed:.1%}", *rest)
            rows.append("<tr>" + "".join(f"<td>{_number(cell)}</td>" for cell in cells) + "</tr>")
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    return (
        "<section class='card'><h2>Against motion compensation</h2><table class='wide'><thead><tr>"
        f"{head}</tr></thead><tbody>{''.join(rows)}</tbody></table><p>Sharpness relative to the image of all events "
        "as they are, which is also what warping without motion leaves; contrast maximisation finds the motion from "
        "scratch, warping and cancelling are given it. Zero and reversed motion are the controls of both.</p></section>"
    )


def _remarks(notes: Sequence[str]) -> str:
    if not notes:
        return ""
    lines = "".join(f"<li>{escape(note)}</li>" for note in notes)
    return f"<section class='remarks'><h2>Remarks</h2><ul>{lines}</ul></section>"


def _figure(drawing: Drawing) -> str:
    data = base64.b64encode(drawing.path.read_bytes()).decode("ascii")
    return (
        f'<figure><h2>{escape(drawing.title)}</h2><img alt="{escape(drawing.title)}" '
        f'src="data:image/png;base64,{data}"><figcaption>{escape(drawing.caption)}</figcaption></figure>'
    )


def _film(video: Path | None, words: str) -> str:
    """Show the high-pass video."""
    if video is None:
        return ""
    if video.suffix == ".gif":
        data = base64.b64encode(video.read_bytes()).decode("ascii")
        shown = f'<img alt="high-pass video" src="data:image/gif;base64,{data}">'
    else:
        shown = f'<video controls loop width="100%" src="{escape(video.name)}"></video>'
    return (
        f"<figure><h2>§6.3.1 · High-pass video</h2>{shown}<figcaption>Left all events, right what the streaming "
        f"canceller sends on; {escape(words)}signed, bilinear.</figcaption></figure>"
    )
