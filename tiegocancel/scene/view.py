"""Hold what a stage shows: the light on its pixels, and how much of the background its movers let through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["View"]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class View:
    """The light on ``n`` pixels at some instants, ``m`` of which a mover may touch meanwhile.

    ``levels`` float32[n, steps] is the log-intensity. ``veiled`` int32[n] is the pixel's row in ``clear`` and
    ``behind``, −1 where no mover comes; ``clear`` float32[m, steps] is the share of the pixel through which the
    background is seen, and ``behind`` float32[m, steps] the log-intensity that the background alone would have.
    """

    levels: NDArray[np.float32]
    veiled: NDArray[np.int32]
    clear: NDArray[np.float32]
    behind: NDArray[np.float32]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """Where a mover covers any of the pixel, bool[n, steps]."""
        covered = np.zeros(self.levels.shape, np.bool_)
        touched = self.veiled >= 0
        covered[touched] = self.clear[self.veiled[touched]] < 1.0
        return covered
