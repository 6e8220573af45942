"""Say in a sentence what a run shows, and what it does not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tiegocancel.study.result import RunResult

__all__ = ["Verdict", "judge"]

SHOWS_NOTHING = 0.05
"""Below this gap to the best control, the ratio is what chance and a wide gate give."""
SELECTIVE = 0.25


@dataclass(frozen=True, slots=True)
class Verdict:
    """``grade`` of an operating point, its ``headline`` and the ``reasons`` for it, whole sentences."""

    grade: Literal["selective", "weak", "nothing", "unknown"]
    headline: str
    reasons: tuple[str, ...]


def judge(result: RunResult) -> Verdict:
    """Compare the ratio on the disc with wrong motions and with chance; where events are labelled, ego with mover."""
    config = result.settings.cancel
    share = result.tally.share(on_disc=True)
    if not share.events:
        share = result.tally.share()
    if not share.events or not result.controls:
        return Verdict("unknown", "There is nothing to compare.", (_nothing_to_compare(result),))
    controls = {name: tally.share(on_disc=True).ratio for name, tally in result.controls.items()}
    chance = controls.pop("time_shuffled")
    rival = max(controls, key=lambda name: controls[name])
    gap = share.ratio - controls[rival]
    rim, gate = result.rim_displacement_px, config.tolerance_px
    moved = (
        f"Within the horizon of {config.horizon_us / 1000:g} ms the rim of the disc moves {rim:.1f} px; the spatial "
        f"gate reaches {gate:g} px."
    )
    if rim > 2 * gate:
        moved += (
            " Whatever does not follow the motion is elsewhere by then, and that is what makes a match selective; the "
            "price is a ring that holds the events of a whole horizon."
        )
    compared = (
        f"On the disc {share.ratio:.1%} are suppressed; with {_NAMES[rival]} it would be {controls[rival]:.1%}: "
        f"a gap of {100 * gap:.1f} points."
    )
    reasons = [compared, moved]
    if chance > share.ratio - SHOWS_NOTHING:
        reasons.append(
            f"With the times shuffled {chance:.1%} would be suppressed: at this density of events the gates fill by "
            "chance, so that an independent mover here would be lost too. Narrower gates tell more."
        )
    selectivity = result.tally.selectivity()
    if selectivity is not None:
        reasons.append(
            f"By label: {selectivity['ego']:.1%} of the ego-motion events and {selectivity['mover']:.1%} of the "
            f"independent mover's events are suppressed, so J = {selectivity['j']:.2f}."
        )
    if gap < SHOWS_NOTHING:
        reasons.append(
            'Where motion stays inside the gate, predicting "same place" does as well, and an independent mover is '
            "lost as surely as the background: choose a longer horizon or a narrower gate."
            if rim <= 2 * gate
            else "The motion given does not predict these events: check centre, speed and sign."
        )
        return Verdict("nothing", "This operating point shows nothing: a control cancels as much.", tuple(reasons))
    if gap < SELECTIVE:
        return Verdict("weak", "Part of this ratio is chance: the controls come close.", tuple(reasons))
    return Verdict("selective", "The motion explains what is suppressed: the controls stay far behind.", tuple(reasons))


_NAMES = {"zero_motion": "zero motion", "reversed_motion": "reversed motion", "time_shuffled": "shuffled times"}


def _nothing_to_compare(result: RunResult) -> str:
    """Say why no verdict is possible."""
    if not result.controls:
        return "The controls were switched off, and a ratio without controls shows nothing."
    return f"No event lies beyond the warm-up of {result.settings.cancel.warm_up_us / 1000:g} ms."
