"""Write one self-contained HTML page that leads with the numbers and their controls."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from tiegocancel.matching.config import CancelConfig
from tiegocancel.report.figures import Drawing
from tiegocancel.study.controls import CONTROLS
from tiegocancel.study.result import RunResult
from tiegocancel.study.verdict import Verdict
from tiegocancel.units import rate_text

__all__ = ["write_page"]


def write_page(
    path: Path, result: RunResult, verdict: Verdict, drawings: list[Drawing], *, title: str, notes: Sequence[str] = ()
) -> None:
    """Write the report of ``result`` to ``path``; figures are embedded, nothing is loaded from elsewhere."""
    numbers = result.to_json()
    tiles = _tiles(result, numbers)
    template = Template(files("tiegocancel.report").joinpath("page.html").read_text(encoding="utf-8"))
    # A file name may hold bytes that are no text; they are shown escaped.
    path.write_text(
        template.substitute(
            title=escape(title),
            subtitle=escape(_subtitle(result)),
            grade=verdict.grade,
            headline=escape(verdict.headline),
            fault=""
            if result.fault is None
            else f"<section class='fault'>Incomplete: {escape(result.fault)}</section>",
            reasons="".join(f"<p>{escape(reason)}</p>" for reason in verdict.reasons),
            tiles="".join(_tile(*tile) for tile in tiles),
            columns={5: 5, 6: 3}.get(len(tiles), 4),
            controls=_control_table(result, numbers),
            figures="".join(_figure(drawing) for drawing in drawings),
            details="".join(_details(heading, rows) for heading, rows in _detail_tables(result, numbers)),
            remarks=_remarks(result, notes),
        ),
        encoding="utf-8",
        errors="backslashreplace",
    )


def _subtitle(result: RunResult) -> str:
    rate_hz = result.counters.events / result.duration_s if result.duration_s else 0.0
    return (
        f"{result.counters.events:,} events of {result.width}×{result.height} px in {result.duration_s:.3f} s "
        f"({rate_text(rate_hz)}), horizon {result.settings.cancel.horizon_us / 1000:g} ms"
    )


def _tiles(result: RunResult, numbers: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Return value, name and remark of the numbers that lead the page."""
    share = result.tally.share(on_disc=result.lead_region)
    tiles = [
        (_share(numbers["cancellation_ratio"], result.tally.share().events), "cancellation ratio", "need not be sent")
    ]
    if result.lead_region:
        tiles.append((_share(share.ratio, share.events), "on the disc", f"radius {result.region.radius_px:g} px"))
    if result.controls and share.events:
        best = max(tally.share(on_disc=result.lead_region).ratio for tally in result.controls.values())
        tiles.append((f"{100 * (share.ratio - best):+.1f} points", "beyond the best control", _where(result)))
    selectivity = numbers["selectivity"]
    if selectivity is not None and selectivity["j"] is not None:
        tiles.append((f"{selectivity['mover']:.1%}", "of the mover lost", "suppressed wrongly"))
        tiles.append((f"{selectivity['j']:.3f}", "selectivity J", "ego − mover share"))
    if result.duration_s and result.tally.share().events:
        rate_hz = numbers["events"] / result.duration_s
        sent = rate_text(rate_hz * (1 - numbers["cancellation_ratio"]))
        tiles.append((sent, "still sent", f"of {rate_text(rate_hz)}, after the warm-up"))
    tiles.append((f"{numbers['state']['kib']:,.0f} KiB", "of state", "ring and table, constant"))
    tiles.append((rate_text(numbers["events_per_second"]), "decided", "on this machine, one thread"))
    return tiles


def _where(result: RunResult) -> str:
    return "on the disc" if result.lead_region else "everywhere"


def _share(value: float | None, events: int = 1) -> str:
    """Write a share, or a dash where nothing was measured."""
    return f"{value:.1%}" if value is not None and events else "–"


def _tile(value: str, name: str, remark: str) -> str:
    return (
        f'<div class="tile"><div class="value">{escape(value)}</div><div class="name">{escape(name)}</div>'
        f'<div class="remark">{escape(remark)}</div></div>'
    )


def _control_table(result: RunResult, numbers: dict[str, Any]) -> str:
    """Show the ratios of the run and of its controls side by side."""
    labelled = numbers["selectivity"] is not None
    heads = ["", "all events"] + (["disc", "background"] if numbers["disc_seen"] else [])
    heads += (["ego", "mover", "noise", "J"] if labelled else []) + ["meaning"]
    rows = [_ratio_row("motion given", "what the canceller was told", numbers["cancellation_ratio"], None, numbers)]
    for name, ratio in numbers["controls"].items():
        rows.append(_ratio_row(CONTROLS[name].label, CONTROLS[name].meaning, ratio, name, numbers))
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    return f"<table class='ratios'><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def _ratio_row(name: str, meaning: str, whole: float, control: str | None, numbers: dict[str, Any]) -> str:
    regions = [numbers["regions"][region] for region in ("disc", "background") if numbers["disc_seen"]]
    shares = [whole] + [region["controls"][control] if control else region["cancellation_ratio"] for region in regions]
    counts = [numbers["warm_up"]["events_counted"], *(region["events"] for region in regions)]
    cells = [_share(share, count) for share, count in zip(shares, counts, strict=True)]
    if numbers["selectivity"] is not None:
        selectivity = numbers["selectivity_of_controls"][control] if control else numbers["selectivity"]
        cells += [_share(selectivity[cause]) for cause in ("ego", "mover", "noise")]
        cells.append("–" if selectivity["j"] is None else f"{selectivity['j']:.2f}")
    body = "".join(f"<td class='number'>{cell}</td>" for cell in cells)
    lead = " class='lead'" if control is None else ""
    return f"<tr{lead}><th>{escape(name)}</th>{body}<td class='meaning'>{escape(meaning)}</td></tr>"


def _detail_tables(result: RunResult, numbers: dict[str, Any]) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return the tables at the end of the page: operating point, motion, residual, counters."""
    cancel, motion, found = result.settings.cancel, numbers["motion"], numbers["displacement"]
    ratio = numbers["signal_to_noise"]
    density = numbers["regions"]
    point = [
        ("horizon Δt", f"{cancel.horizon_us:,} µs"),
        ("temporal gate ε_t", f"±{cancel.tolerance_us:,} µs"),
        ("spatial gate ε_xy", f"{cancel.tolerance_px:g} px"),
        ("polarity", cancel.polarity),
        ("ring capacity", f"{cancel.ring_capacity:,} predictions"),
        ("motion path", result.settings.motion.path),
    ]
    if not cancel.is_plain:
        point.append(("selective rule", _selective_words(cancel)))
    turning = [
        ("mean", motion["described"]),
        ("source", motion["source"]),
        ("rim displacement within Δt", f"{motion['rim_displacement_px']:.1f} px"),
    ]
    if result.estimates:
        rows = f"{motion['estimates']:,}, {motion['estimates_confident']:,} confident"
        turning.append(("estimates on the way", rows))
    if result.diagnosis is not None:
        turning.append(("diagnosis", result.diagnosis.text))
    rest = [
        ("CR (causal)", f"{numbers['cancellation_ratio']:.2%}"),
        ("CR_pairs (thesis, offline)", f"{numbers['cancellation_ratio_pairs']:.2%}"),
        (
            "warm-up left out",
            f"{numbers['warm_up']['us'] / 1000:g} ms, {numbers['warm_up']['events_left_out']:,} events",
        ),
        *(
            (
                f"{name}, events a pixel",
                f"{density[name]['events_per_px']:.3g} → {density[name]['residual_per_px']:.3g}",
            )
            for name in ("disc", "background")
        ),
        ("(N_disc − N_bg)/N_bg, densities", f"{_optional(ratio['before'])} → {_optional(ratio['after'])}"),
    ]
    if found["matches"]:
        rest.append(("match distance, mean / 95 %", f"{found['mean_px']:.2f} / {found['p95_px']:.2f} px"))
        rest.append(("mean residual (dx, dy)", f"({found['mean_dx_px']:+.2f}, {found['mean_dy_px']:+.2f}) px"))
        rest.append(("mean lateness", f"{found['mean_late_us']:+.0f} µs"))
    counts = [(name.replace("_", " "), f"{value:,}") for name, value in numbers["counters"].items()]
    return [("Operating point", point), ("Motion", turning), ("Residual", rest), ("Counters", counts)]


def _selective_words(cancel: CancelConfig) -> str:
    """Say what the configuration has beyond the plain rule."""
    words = [f"need {cancel.need} of support", f"carry {cancel.carry}"]
    if cancel.more_horizons_us:
        words.append("more horizons " + ", ".join(f"{horizon_us:,} µs" for horizon_us in cancel.more_horizons_us))
    words.append("cells latched" if cancel.uses == 0 else f"{cancel.uses} use(s) a cell")
    words.append(f"gate −{cancel.early_gate_us:,} to +{cancel.late_gate_us:,} µs")
    if cancel.tick_bits:
        words.append(f"tick {1 << cancel.tick_bits} µs")
    if cancel.bin_bits:
        words.append(f"bins of {1 << cancel.bin_bits}×{1 << cancel.bin_bits} px")
    if cancel.set_bits is not None:
        words.append(f"{1 << cancel.set_bits[0]}×{1 << cancel.set_bits[1]} sets of {cancel.ways}")
    if cancel.least_shift_px:
        words.append(f"least shift {cancel.least_shift_px:g} px")
    if cancel.motion_at == "gate":
        words.append("motion of the time when the gate opens")
    return ", ".join(words)


def _details(heading: str, rows: list[tuple[str, str]]) -> str:
    body = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows)
    return f"<section><h3>{escape(heading)}</h3><table>{body}</table></section>"


def _optional(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _figure(drawing: Drawing) -> str:
    data = base64.b64encode(drawing.path.read_bytes()).decode("ascii")
    return (
        f'<figure><h2>{escape(drawing.title)}</h2><img alt="{escape(drawing.title)}" '
        f'src="data:image/png;base64,{data}"><figcaption>{escape(drawing.caption)}</figcaption></figure>'
    )


def _remarks(result: RunResult, notes: Sequence[str]) -> str:
    """List what was assumed and what fell short."""
    lines = [*result.notes, *notes, *result.trajectory.notes]
    if not lines:
        return ""
    return (
        "<section class='remarks'><h2>Remarks</h2><ul>"
        + "".join(f"<li>{escape(line)}</li>" for line in lines)
        + "</ul></section>"
    )
