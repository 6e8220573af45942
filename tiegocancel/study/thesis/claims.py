"""List what the thesis claims, as it prints it, with where it stands."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["HEADLINES", "RATIOS", "SLIPS", "RatioClaim", "Slip"]


@dataclass(frozen=True, slots=True, kw_only=True)
class RatioClaim:
    """A cancellation ratio: ``value`` at ``horizon_us``, of the whole image or (``group`` ``disc_``) of a region.

    ``tolerance_*`` ``None`` are the gates of the study.
    """

    where: str
    what: str
    value: float
    horizon_us: int
    group: str = ""
    tolerance_px: float | None = None
    tolerance_us: int | None = None


RATIOS = (
    RatioClaim(where="Table 7.1", what="CR at Δt = 0, ten times the best of 525", value=1.0, horizon_us=0),
    RatioClaim(where="§7.1, Fig. 7.1", what="CR at Δt = 1 ms, “exceeds 90 %”", value=0.90, horizon_us=1000),
    RatioClaim(where="§7.1, Fig. 7.1", what="CR at Δt = 6 ms", value=0.35, horizon_us=6000),
    RatioClaim(where="§7.1, Fig. 7.1", what="CR at Δt = 20 ms, “20 to 25 %”", value=0.225, horizon_us=20_000),
    RatioClaim(
        where="§7.2", what="CR at 6 ms, widest gates", value=0.40, horizon_us=6000, tolerance_px=5.0, tolerance_us=2500
    ),
    RatioClaim(where="Table 7.2", what="CR on the disc, 1 ms", value=0.882, horizon_us=1000, group="disc_"),
    RatioClaim(where="Table 7.2", what="CR on the disc, 2 ms", value=0.851, horizon_us=2000, group="disc_"),
    RatioClaim(where="Table 7.2", what="CR on the disc, 4 ms", value=0.723, horizon_us=4000, group="disc_"),
    RatioClaim(where="Table 7.2", what="CR on the disc, 6 ms", value=0.584, horizon_us=6000, group="disc_"),
    RatioClaim(where="Table 7.2", what="CR of the background, 1 ms", value=0.125, horizon_us=1000, group="background_"),
    RatioClaim(
        where="§7.8, Fig. 7.8", what="CR at 8 ms, the failure case", value=0.30, horizon_us=8000, tolerance_px=3.0,
        tolerance_us=2000,
    ),
)  # fmt: skip

HEADLINES = (
    ("abstract, §10.1", 0.84),
    ("§7.9", 0.88),
    ("§7.1, §8.1", 0.90),
)
"""What the thesis gives for one and the same result: the best CR at short horizons."""


@dataclass(frozen=True, slots=True)
class Slip:
    """A number that contradicts another of the thesis's: ``where`` it stands, what it ``says``, what ``follows``."""

    where: str
    says: str
    follows: str


SLIPS = (
    Slip(
        "§6.1.2, §6.2.1",
        "1.5–3.5 rev/s, “corresponding to ω ≈ 1.5–3.5 rad/s”",
        "1.5–3.5 rev/s are 9.4–22.0 rad/s; tracker and events agree on about 3.6 rad/s, which is 0.57 rev/s",
    ),
    Slip(
        "§8.5, §8.7",
        "linear up to ±0.05 rad/ms",
        "0.05 rad/ms are 50 rad/s, a thousand times the 0.05 rad/s of §7.7 and fourteen times ω itself",
    ),
    Slip(
        "§7.1, §7.8",
        "ω ≈ 2 rad/s, and ε_xy ≈ rωτ½ “validates” τ½ = 3.5 ms",
        "with r = 264 px that gives 1.8 px at 2 rad/s but 3.3 px at the 3.6 rad/s of Table 6.1, against ε_xy = 2 px",
    ),
    Slip(
        "§6.2.1",
        "the rim reaches about 800 px/s",
        "264 px at 3.6 rad/s move at 950 px/s; 800 px/s need 3.0 rad/s",
    ),
    Slip(
        "Table 6.1, §6.2",
        "36.3 million events in 10 s; windows W1–W3 in the caption and Fig. 7.1, W1–W6 in the table and text",
        "3.6 Mev/s on average; the published 10 ms of the same recording hold 98,626 events, 9.9 Mev/s",
    ),
    Slip(
        "§8.1 against §7.1",
        "the plateau is 30–35 %, and 20–25 %",
        "two values for one curve",
    ),
    Slip(
        "Table 7.1 against §7.2",
        "the text finds the optimum at Δt = 1–2 ms, ε_xy = 2–3 px, ε_t ≈ 1 ms",
        "its table lists Δt = 0 ten times, where every event meets itself",
    ),
)
