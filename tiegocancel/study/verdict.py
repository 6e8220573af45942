"""Say in a sentence what a run shows, and what it does not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tiegocancel.study.controls import CONTROLS
from tiegocancel.study.result import RunResult

__all__ = ["Verdict", "judge"]

SHOWS_NOTHING = 0.05
"""Below this gap to the best control, the ratio is what chance and a wide gate give."""
FEWEST_EVENTS = 200
MUCH_OVERFLOW = 0.05
SELECTIVE = 0.2
"""From this gap on, no control comes close. A judgement, not a law: the gap itself always stands beside it."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """``grade`` of an operating point, its ``headline`` and the ``reasons`` for it, whole sentences."""

    grade: Literal["selective", "weak", "nothing", "unknown"]
    headline: str
    reasons: tuple[str, ...]


def judge(result: RunResult) -> Verdict:
    """Compare the ratio with wrong motions and with chance, on the disc where it has events, else everywhere."""
    config = result.settings.cancel
    share = result.tally.share(on_disc=result.lead_region)
    if not result.controls:
        told = "A ratio without controls shows nothing."
        return Verdict("unknown", "The controls were switched off.", (*_first_reasons(result), told))
    if share.events < FEWEST_EVENTS:
        told = (
            f"{share.events} events lie beyond the warm-up of {config.warm_up_us / 1000:g} ms, and a verdict needs "
            f"{FEWEST_EVENTS}: a longer recording or a shorter horizon leaves more."
        )
        return Verdict("unknown", "There is too little to compare.", (*_first_reasons(result), told))
    controls = {name: tally.share(on_disc=result.lead_region).ratio for name, tally in result.controls.items()}
    rival = max(controls, key=lambda name: controls[name])
    gap = share.ratio - controls[rival]
    place = "On the disc" if result.lead_region else "Everywhere"
    reasons = [
        *_first_reasons(result),
        f"{place} {share.ratio:.1%} are suppressed; with {CONTROLS[rival].label} it would be {controls[rival]:.1%}: "
        f"a gap of {100 * gap:.1f} points.",
        _moved(result, selective=gap >= SELECTIVE),
    ]
    selectivity = result.tally.selectivity()
    if selectivity is not None and selectivity["j"] is not None:
        reasons.append(
            f"By label: {selectivity['ego']:.1%} of the ego-motion events and {selectivity['mover']:.1%} of the "
            f"independent mover's events are suppressed, so J = {selectivity['j']:.3f}."
        )
    if gap < SELECTIVE:
        reasons.append(_advice(result, rival))
    if gap < SHOWS_NOTHING:
        return Verdict("nothing", "This operating point shows nothing: a control cancels as much.", tuple(reasons))
    if gap < SELECTIVE:
        return Verdict("weak", "Part of this ratio is chance: a control comes close.", tuple(reasons))
    return Verdict("selective", "The motion explains what is suppressed: the controls stay far behind.", tuple(reasons))


def _advice(result: RunResult, rival: str) -> str:
    """Say why a control does so well, and what would tell more."""
    if rival == "time_shuffled":
        return (
            "At this density of events the gates fill by chance, so that an independent mover would be lost there too: "
            "narrower gates tell more."
        )
    if result.rim_displacement_px <= 2 * result.settings.cancel.tolerance_px:
        return (
            'Where motion stays inside the gate, predicting "same place" does as well, and an independent mover is '
            "lost as surely as the background: choose a longer horizon or a narrower gate."
        )
    return "The motion given does not predict these events well: check centre, speed and sign."


def _first_reasons(result: RunResult) -> list[str]:
    """Say what comes before any comparison: an incomplete run, a ring too small."""
    reasons = []
    if result.fault is not None:
        reasons.append(f"The run is incomplete: {result.fault}.")
    lost = result.counters.overflow / max(result.counters.events, 1)
    if lost > MUCH_OVERFLOW:
        reasons.append(f"The ring was too small: {lost:.0%} of the predictions were discarded.")
    return reasons


def _moved(result: RunResult, *, selective: bool) -> str:
    """Compare the way that the rim moves with the gate."""
    rim, gate = result.rim_displacement_px, result.settings.cancel.tolerance_px
    place = "the rim of the disc moves" if result.disc_seen else "the outermost events move"
    moved = (
        f"Within the horizon of {result.settings.cancel.horizon_us / 1000:g} ms {place} {rim:.1f} px; the spatial gate "
        f"reaches {gate:g} px."
    )
    if selective and rim > 2 * gate:
        moved += (
            " Whatever does not follow the motion is elsewhere by then, and that is what makes a match selective; the "
            "price is a ring that holds the events of a whole horizon."
        )
    return moved
