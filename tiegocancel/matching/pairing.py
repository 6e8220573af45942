"""Pair the real events of a gate with the predictions of a gate, one to one (thesis, §5.5 and lines 11 to 19)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tiegocancel.matching.forecast import Forecast
from tiegocancel.matching.nearest import nearest_admissible, within
from tiegocancel.matching.reference_config import ReferenceConfig

__all__ = ["pair_up"]


def pair_up(
    real: NDArray[np.int64], predicted: NDArray[np.int64], forecast: Forecast, config: ReferenceConfig
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Return real events, the events whose predictions they meet, and the distance in px, of the accepted pairs.

    ``real`` int64[n] and ``predicted`` int64[m] are rows of the stream, both in order of time. ``greedy``: each real
    event proposes its nearest prediction, and each prediction takes the nearest proposal, the earlier of equals: that
    is what sorting by distance and accepting one to one comes to where every event proposes once. ``mutual``: a pair
    counts when each is the other's nearest.
    """
    if len(real) == 1 == len(predicted):
        return _pair_of_two(int(real[0]), int(predicted[0]), forecast, config)
    places = np.column_stack([forecast.x[real], forecast.y[real]])
    ahead = np.column_stack([forecast.ahead_x[predicted], forecast.ahead_y[predicted]])
    reach_px = float(forecast.reach_px[predicted].max(initial=0.0))

    def admissible(j: NDArray[np.int64], k: NDArray[np.int64], far: NDArray[np.float64]) -> NDArray[np.bool_]:
        return forecast.admits(real[j], predicted[k], far, config)

    met, far = nearest_admissible(places, ahead, reach_px, admissible, index=config.index)
    proposing = np.flatnonzero(met >= 0)
    if config.pairing == "mutual":
        back, _ = nearest_admissible(ahead, places, reach_px, lambda k, j, d: admissible(j, k, d), index=config.index)
        proposing = proposing[back[met[proposing]] == proposing]
    proposing = proposing[forecast.agrees(real[proposing], predicted[met[proposing]], config)]
    proposing = proposing[np.lexsort((proposing, far[proposing]))]
    _, first = np.unique(met[proposing], return_index=True)
    accepted = proposing[np.sort(first)]
    return real[accepted], predicted[met[accepted]], far[accepted]


def _pair_of_two(
    j: int, k: int, forecast: Forecast, config: ReferenceConfig
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Decide the only pair there is: every batch at Δt = 0, where whole arrays would cost twenty times as much."""
    far = math.hypot(forecast.x[j] - forecast.ahead_x[k], forecast.y[j] - forecast.ahead_y[k])
    meets = within(far, forecast.reach_px[k]) and (j != k or config.allow_self_match)
    if meets and config.gate == "pair":
        meets = abs(forecast.t_us[j] - forecast.due_us[k]) <= config.tolerance_us
    if meets and config.polarity != "ignore":
        meets = (forecast.p[j] == forecast.p[k]) == (config.polarity == "opposite")
    rows = 1 if meets else 0
    return np.array([j], np.int64)[:rows], np.array([k], np.int64)[:rows], np.array([far])[:rows]
