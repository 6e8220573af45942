"""Hold the parameters of the thesis's algorithm, with every choice that its text leaves open."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from tiegocancel.matching.config import MAX_GATE_US, MAX_TOLERANCE_PX, Polarity
from tiegocancel.matching.nearest import SpatialIndex

__all__ = ["AdaptiveTolerance", "ReferenceConfig"]


@dataclass(frozen=True, slots=True, kw_only=True)
class AdaptiveTolerance:
    """Let the spatial gate grow with the radius: ``ε_xy(r) = k(r|ω|τ_t + ‖Δc‖)`` (eq. 5.5).

    ``k`` from 1.5 to 2.5 in the thesis; ``timing_us`` is τ_t; ``center_px`` is ‖Δc‖.
    """

    k: float = 2.0
    timing_us: float = 1000.0
    center_px: float = 0.5

    def __post_init__(self) -> None:
        for name in ("k", "timing_us", "center_px"):
            value = getattr(self, name)
            if isinstance(value, bool) or not (math.isfinite(value) and value >= 0):
                raise ValueError(f"{name} must be a finite number of at least 0, not {value!r}")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceConfig:
    """Run Algorithm 1 as printed, unless told otherwise; what each choice means stands in :mod:`.reference`.

    ``horizon_us`` Δt, ``tolerance_us`` ε_t, ``tolerance_px`` ε_xy, both gates inclusive; ``adaptive`` replaces ε_xy by
    one that grows with the radius. ``polarity`` as in ``semantics.md``; ``polarity_first`` passes over predictions of
    the wrong polarity when the nearest is sought. ``allow_self_match``: an event may meet its own prediction.
    ``pairing``: ``greedy`` by distance or ``mutual`` nearest neighbours. ``release``: predictions are decided as
    ``printed`` (line 9), or when their gate has ``closed``. ``gate`` in time: of the whole ``batch`` (line 10) or of
    each ``pair`` (eq. 4.4). ``index``: k-d ``tree`` or uniform ``grid``.
    """

    horizon_us: int = 2000
    tolerance_us: int = 1000
    tolerance_px: float = 2.0
    adaptive: AdaptiveTolerance | None = None
    polarity: Polarity = "opposite"
    polarity_first: bool = False
    allow_self_match: bool = True
    pairing: Literal["greedy", "mutual"] = "greedy"
    release: Literal["printed", "closed"] = "printed"
    gate: Literal["batch", "pair"] = "batch"
    index: SpatialIndex = "tree"

    def __post_init__(self) -> None:
        for name in ("horizon_us", "tolerance_us"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MAX_GATE_US:
                raise ValueError(f"{name} must be an integer from 0 to {MAX_GATE_US}, not {value!r}")
        if isinstance(self.tolerance_px, bool) or not 0 <= self.tolerance_px <= MAX_TOLERANCE_PX:
            raise ValueError(f"tolerance_px must be a number from 0 to {MAX_TOLERANCE_PX:g}, not {self.tolerance_px!r}")
        choices = {
            "polarity": ("opposite", "equal", "ignore"),
            "pairing": ("greedy", "mutual"),
            "release": ("printed", "closed"),
            "gate": ("batch", "pair"),
            "index": ("tree", "grid"),
        }
        for name, known in choices.items():
            if getattr(self, name) not in known:
                raise ValueError(f"{name} must be one of {', '.join(known)}, not {getattr(self, name)!r}")

    @property
    def warm_up_us(self) -> int:
        """Time after the first event in which predictions cannot all have been met."""
        return self.horizon_us + self.tolerance_us
