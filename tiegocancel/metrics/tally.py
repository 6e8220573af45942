"""Count events, suppressed events and pairs by ring, region and label; turn the counts into the ratios of a report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import EGO, MOVER, NOISE, Events
from tiegocancel.metrics.regions import DiscRegion

__all__ = ["Share", "Tally"]

_UNLABELLED = 3
_EVENTS, _SUPPRESSED, _PAIRS = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Share:
    """Count ``events``, the ``suppressed`` among them, and ``pairs``: suppressed or their prediction was used."""

    events: int
    suppressed: int
    pairs: int

    @property
    def ratio(self) -> float:
        """CR = |S| / |E|: the bandwidth that a causal device saves; 0 without events."""
        return self.suppressed / self.events if self.events else 0.0

    @property
    def ratio_pairs(self) -> float:
        """CR_pairs = |S ∪ U| / |E|: the thesis's offline pair removal; 0 without events."""
        return self.pairs / self.events if self.events else 0.0


class Tally:
    """Accumulate counts of events from ``counted_from_us`` on: what comes before is warm-up."""

    def __init__(self, region: DiscRegion, counted_from_us: int) -> None:
        self.region, self.counted_from_us = region, counted_from_us
        self.warm_up_events = 0
        self._counts = np.zeros((3, region.rings, 2, 4), np.int64)  # kind, ring, on the disc, label
        self._labelled = False

    def add(self, events: Events, suppressed: NDArray[np.bool_], used: NDArray[np.bool_] | None = None) -> None:
        """Count a chunk: ``suppressed`` bool[n], ``used`` bool[n] where pairs are wanted."""
        first = int(np.searchsorted(events.t, self.counted_from_us, side="left"))
        self.warm_up_events += first
        events, suppressed = events[first:], suppressed[first:]
        label: NDArray[np.int8] | int = _UNLABELLED if events.label is None else events.label
        self._labelled |= events.label is not None
        codes = self.region.codes(events) * 4 + label
        self._count(_EVENTS, codes)
        self._count(_SUPPRESSED, codes[suppressed])
        if used is not None:
            self._count(_PAIRS, codes[suppressed | used[first:]])

    def _count(self, kind: int, codes: NDArray[np.int32]) -> None:
        self._counts[kind] += np.bincount(codes, minlength=self._counts[kind].size).reshape(self._counts[kind].shape)

    def share(self, *, on_disc: bool | None = None, label: int | None = None) -> Share:
        """Return the counts of a region and label; ``None`` means all."""
        part = self._counts if label is None else self._counts[..., label : label + 1]
        if on_disc is not None:
            part = part[:, :, int(on_disc) : int(on_disc) + 1]
        return Share(*(int(value) for value in part.sum(axis=(1, 2, 3))))

    @property
    def labelled(self) -> bool:
        """Tell whether any event carried a label."""
        return self._labelled

    def selectivity(self) -> dict[str, float | None] | None:
        """Return the shares of ego, mover and noise events suppressed, and J = ego − mover; ``None`` unlabelled.

        The share of a cause without events is ``None``, and so is J without ego or without mover.
        """
        if not self._labelled:
            return None
        counts = [self.share(label=label) for label in (EGO, MOVER, NOISE)]
        ego, mover, noise = (count.ratio if count.events else None for count in counts)
        j = None if ego is None or mover is None else ego - mover
        return {"ego": ego, "mover": mover, "noise": noise, "j": j}

    def radial(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Return area in px, events and residual events of each ring, int64[rings] each."""
        by_ring = self._counts.sum(axis=(2, 3))
        return self.region.areas_px.sum(axis=1), by_ring[_EVENTS], by_ring[_EVENTS] - by_ring[_SUPPRESSED]

    def densities(self) -> dict[str, dict[str, float]]:
        """Return events and residual events per pixel, on the disc and in the background (0 where there is no area)."""
        densities = {}
        for name, on_disc in (("disc", True), ("background", False)):
            area = int(self.region.areas_px[:, int(on_disc)].sum())
            share = self.share(on_disc=on_disc)
            densities[name] = {
                "events_per_px": share.events / area if area else 0.0,
                "residual_per_px": (share.events - share.suppressed) / area if area else 0.0,
            }
        return densities

    def signal_to_noise(self) -> dict[str, float | None]:
        """Return (N_disc − N_bg) / N_bg of the densities, before and after (thesis, §8.6), ``None`` if quiet."""
        densities = self.densities()
        ratios: dict[str, float | None] = {}
        for name, key in (("before", "events_per_px"), ("after", "residual_per_px")):
            background = densities["background"][key]
            ratios[name] = (densities["disc"][key] - background) / background if background else None
        return ratios
