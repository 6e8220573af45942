"""Prepare the events of one window for the climb to the peak of their contrast."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events

__all__ = ["Rates", "Scratch", "Slopes", "Window", "unfolded"]

Rates = NDArray[np.float64]
"""``a b c d e f`` of the velocity field ``(a·x + b·y + c, d·x + e·y + f)`` about an anchor, in 1/s and px/s."""

_MARGIN_CELLS = 6
_MOST_CELLS = 1 << 22
_MOST_TURN = 20.0
_FAR = 1e9
_ORDER = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
_UNFOLD = np.block([[_ORDER, _ORDER + 6], [_ORDER + 6, _ORDER + 12]])


@dataclass(frozen=True, slots=True, eq=False)
class Slopes:
    """Agreement of a window's early and late events, tile by tile, in px a half window.

    ``tile`` [T] is the index in the image, ``events`` [T], ``energy`` [T] and ``slope`` [T, 6] along the six rates;
    ``bends`` [T, 18] and ``squares`` [T, 18] are folded matrices (:func:`unfolded`): the curvature, and the sum of the
    outer products of the single events' slopes. Only tiles with events are listed.
    """

    tile: NDArray[np.int64]
    events: NDArray[np.float64]
    energy: NDArray[np.float64]
    slope: NDArray[np.float64]
    bends: NDArray[np.float64]
    squares: NDArray[np.float64]

    @property
    def curvature(self) -> NDArray[np.float64]:
        """Return the curvature of each tile, float64[T, 6, 6]."""
        return unfolded(self.bends)

    @property
    def spread(self) -> NDArray[np.float64]:
        """Return the sum of outer products of each tile, float64[T, 6, 6]."""
        return unfolded(self.squares)

    @property
    def pan_curvature(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the curvature of each tile along x, mixed, and along y: three of the above, float64[T] each."""
        return self.bends[:, 5], self.bends[:, 11], self.bends[:, 17]


def unfolded(moments: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unfold ``xx xy yy`` × ``XX XY X YY Y 1`` [..., 18] into symmetric matrices [..., 6, 6] over ``a b c d e f``.

    Folded matrices may be summed first: unfolding every tile costs more than the sum.
    """
    matrix: NDArray[np.float64] = moments[..., _UNFOLD]
    return matrix


class Scratch:
    """Keep the memory of the images from window to window: mapping it anew costs as much as filling it."""

    def __init__(self) -> None:
        self._memory: dict[int, NDArray[np.float32]] = {}

    def take(self, shape: tuple[int, ...]) -> NDArray[np.float32]:
        """Return an array with any contents, one for each number of axes; it is valid until the next call for it."""
        size = int(np.prod(shape))
        held = self._memory.get(len(shape))
        if held is None or len(held) < size:
            held = self._memory[len(shape)] = np.empty(size * 5 // 4, np.float32)
        return held[:size].reshape(shape)


class Window:
    """Events of ``[start_us, stop_us)`` that are warped to the middle of the window about ``anchor_px``.

    The image has square cells of ``cell_px`` around the events' own bounding box; ``tile_px`` is the side of the tiles
    of it over which slopes are summed. ON counts +1 and OFF −1, and both +1 unless ``signed``. Time is cut into
    ``slots``, each with one warp. At least one event.
    """

    def __init__(
        self,
        events: Events,
        *,
        start_us: int,
        stop_us: int,
        anchor_px: tuple[float, float],
        tile_px: int = 32,
        signed: bool = True,
        slots: int = 1024,
        scratch: Scratch | None = None,
    ) -> None:
        self.events, self.anchor_px = events, anchor_px
        self.half_s = 0.5e-6 * (stop_us - start_us)
        x, y = events.x.astype(np.float64) - anchor_px[0], events.y.astype(np.float64) - anchor_px[1]
        self.radius_px = max(float(np.sqrt(np.mean(x * x + y * y))), 1.0)
        tau: NDArray[np.float64] = (2.0 * np.arange(slots) + 1.0) / slots - 1.0
        self._tau = tau.astype(np.float32)
        self._x, self._y = x.astype(np.float32), y.astype(np.float32)
        self._low = np.array([x.min(), y.min()])
        self._high = np.array([x.max(), y.max()])
        self._weight = events.p.astype(np.float32) * 2 - 1 if signed else np.ones(len(events), np.float32)
        self._slot = ((events.t - start_us) * slots // max(stop_us - start_us, 1)).astype(np.int32)
        self._tile_px, self._signed = tile_px, signed
        self.start_us, self.stop_us = start_us, stop_us
        self._scratch = scratch or Scratch()

    @property
    def middle_us(self) -> int:
        """Time of the middle."""
        return (self.start_us + self.stop_us) // 2

    @property
    def units(self) -> Rates:
        """Return what one px a half window is in each rate, at :attr:`radius_px`: float64[6]."""
        turn = 1.0 / (self.half_s * self.radius_px)
        along = 1.0 / self.half_s
        return np.array([turn, turn, along, turn, turn, along])

    def slopes(self, rates: Rates, cell_px: float) -> Slopes:
        """Measure the agreement at ``rates`` with its slopes and curvature."""
        from tiegocancel.kernels.slopes import slopes

        self._frame(rates, cell_px)
        sums = slopes(
            x=self._x,
            y=self._y,
            weight=self._weight,
            slot=self._slot,
            tau=self._tau,
            warp=self._warp(rates),
            cells_a_px=1.0 / self._cell,
            origin_cells=self._origin,
            scale=1.0 / self.radius_px,
            image=self._image,
            tile_cells=self._tile_cells,
        )
        held = np.flatnonzero(sums[:, 0])
        sums = sums[held]
        return Slopes(held, sums[:, 0], sums[:, 1], sums[:, 2:8], sums[:, 8:26], sums[:, 26:44])

    def of(self, events: Events) -> Window:
        """Return the window of other events with the same times and anchor."""
        return Window(
            events,
            start_us=self.start_us,
            stop_us=self.stop_us,
            anchor_px=self.anchor_px,
            tile_px=self._tile_px,
            signed=self._signed,
            slots=len(self._tau),
            scratch=self._scratch,
        )

    def within(self, tiles: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Tell which events the last :meth:`slopes` carried into these tiles, bool[n]."""
        if not len(tiles):
            return np.zeros(len(self.events), np.bool_)  # nor is there a place to compute where rates led nowhere
        table = self._warp(self._rates)[self._slot]
        x = table[:, 0] * self._x + table[:, 1] * self._y + table[:, 2]
        y = table[:, 3] * self._x + table[:, 4] * self._y + table[:, 5]
        column = np.floor(x / self._cell + self._origin[0] + 0.5).astype(np.int64) // self._tile_cells
        row = np.floor(y / self._cell + self._origin[1] + 0.5).astype(np.int64) // self._tile_cells
        return np.isin(row * -(-self._image.shape[1] // self._tile_cells) + column, tiles)

    def sharpness(self) -> tuple[float, float]:
        """Return what the last image of :meth:`slopes` shows: its energy over that at rest, and a correlation.

        The correlation, −1 to 1, is that of the early and the late events' images where there is any event: without
        their means, because noise of one polarity alone is as bright early as late.
        """
        from tiegocancel.kernels.slopes import energies, rest

        own, other, shared, first, second, touched = energies(self._image)
        sharpened = own + other + 2.0 * shared
        shared -= first * second / max(touched, 1.0)
        own, other = own - first * first / max(touched, 1.0), other - second * second / max(touched, 1.0)
        still = self._scratch.take(self._image.shape[:2])
        rest(
            x=self._x,
            y=self._y,
            weight=self._weight,
            cells_a_px=1.0 / self._cell,
            origin_cells=self._origin,
            image=still,
        )
        unmoved = float(still.ravel() @ still.ravel())
        alike = shared / np.sqrt(own * other) if min(own, other) > 1e-9 * sharpened else 0.0
        return sharpened / max(unmoved, 1e-12), float(np.clip(alike, -1.0, 1.0))

    def _frame(self, rates: Rates, cell_px: float) -> None:
        """Choose side of a cell, place of the anchor in cells and an image that holds every warped event.

        Where the image would grow too large, cells are widened; events very far out are left out.
        """
        farthest = self.half_s * float(np.abs(rates[[0, 1, 3, 4]]).max()) * self.radius_px * 2.0
        reach = farthest + self.half_s * float(np.abs(rates[[2, 5]]).max())
        size = self._high - self._low
        reach = min(reach, 0.5 * float(size.max()) + 32.0)
        columns, rows = (int(side / cell_px) + 1 for side in (size + 2.0 * reach))
        self._cell = cell_px * max(1.0, float(np.sqrt(columns * rows / _MOST_CELLS)))
        columns, rows = (int(side / self._cell) + 1 + 2 * _MARGIN_CELLS for side in (size + 2.0 * reach))
        right, down = ((reach - self._low) / self._cell + _MARGIN_CELLS).tolist()
        self._origin = (right, down)
        self._image = self._scratch.take((rows, columns, 6))
        self._tile_cells = max(int(self._tile_px / self._cell), 1)
        self._rates = rates

    def _warp(self, rates: Rates) -> NDArray[np.float32]:
        """Return the maps float32[slots, 12] that carry each slot to the middle of the window, and half the way.

        The exponential of ``−τ·G`` as a power series in τ, whose coefficients all slots share; NaN, which is nowhere,
        where a half window would turn or stretch by more than the series bears.
        """
        generator = np.zeros((3, 3))
        generator[:2] = rates.reshape(2, 3) * (self.half_s, self.half_s, self.half_s / self.radius_px)
        if not float(np.abs(generator[:, :2]).max()) <= _MOST_TURN or not float(np.abs(generator[:, 2]).max()) <= _FAR:
            return np.full((len(self._tau), 12), np.nan, np.float32)
        # In units of the radius, so that the norm is that of the turn and not of the distance.
        terms = [np.eye(3)]
        while len(terms) < 64 and float(np.abs(terms[-1]).max()) > 1e-12:
            terms.append(terms[-1] @ generator / len(terms))
        powers = np.stack([term[:2].ravel() for term in terms])
        back = -self._tau.astype(np.float64)
        maps = [np.vander(back * share, len(terms), increasing=True) @ powers for share in (1.0, 0.5)]
        table = np.concatenate(maps, axis=1)
        table[:, [2, 5, 8, 11]] *= self.radius_px
        return table.astype(np.float32)
