"""Score rotations by the contrast of the image of warped events (thesis §3.3.2, Gallego et al. 2018)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.motion.schedule import FRACTION_BITS

__all__ = ["MAX_CELL_BITS", "Contrast", "Twist", "fine_cell_bits"]

MAX_CELL_BITS = 6
"""Largest cell that the kernel takes: 64 px."""

_MARGIN_SHARE = 0.1
_BATCH = 32
_SCALE = float(1 << FRACTION_BITS)


class Twist(NamedTuple):
    """A rotation as the velocity ``(vx, vy)`` in px/s of an anchor pixel and ``ω`` in rad/s.

    Unlike ``(cx, cy, ω)`` it stays well conditioned while ω passes through 0, where the centre has no meaning.
    """

    vx_px_s: float
    vy_px_s: float
    omega_rad_s: float

    @classmethod
    def about(cls, center_px: tuple[float, float], omega_rad_s: float, anchor_px: tuple[float, float]) -> Twist:
        """Return the twist, seen at ``anchor_px``, of a rotation about ``center_px``."""
        right, down = anchor_px[0] - center_px[0], anchor_px[1] - center_px[1]
        return cls(-omega_rad_s * down, omega_rad_s * right, omega_rad_s)

    def scaled(self, factor: float) -> Twist:
        """Return the same path at ``factor`` times the speed."""
        return Twist(self.vx_px_s * factor, self.vy_px_s * factor, self.omega_rad_s * factor)

    def seen_from(self, anchor_px: tuple[float, float], other_px: tuple[float, float]) -> Twist:
        """Return the twist at ``other_px`` of the motion whose twist at ``anchor_px`` this is."""
        right, down = other_px[0] - anchor_px[0], other_px[1] - anchor_px[1]
        return Twist(self.vx_px_s - self.omega_rad_s * down, self.vy_px_s + self.omega_rad_s * right, self.omega_rad_s)

    def center_px(self, anchor_px: tuple[float, float]) -> tuple[float, float]:
        """Return the centre of rotation; the anchor itself where ω is 0."""
        if self.omega_rad_s == 0.0:
            return anchor_px
        return (
            anchor_px[0] - self.vy_px_s / self.omega_rad_s,
            anchor_px[1] + self.vx_px_s / self.omega_rad_s,
        )


def fine_cell_bits(events: Events) -> int:
    """Return the finest cell worth scoring: 2 px, more on sensors so wide that the image would not fit in memory.

    At 1 px the pixel grid itself shows in the image and pulls ω by a few per cent.
    """
    return min(1 + ((max(events.width, events.height) - 1) >> 11).bit_length(), MAX_CELL_BITS)


class Contrast:
    """Variance of the image of warped events of one window, relative to that of the events as they are.

    Every event is rotated to the middle of the window and spread over square cells of ``2^cell_bits`` px; ON counts
    +1 and OFF −1 (both +1 with ``signed=False``). The image is wider than the sensor by a tenth on each side; events
    beyond it are lost to the score, so that no motion gains by throwing events out. Time is cut into ``slots`` equal
    parts, each with its own warp in fixed point. At most 2^18 events; they must span at least 1 µs.
    """

    def __init__(
        self, events: Events, *, anchor_px: tuple[float, float], cell_bits: int, signed: bool, slots: int
    ) -> None:
        from tiegocancel.kernels.warp import EVENT_WEIGHT, warp_energy

        self._kernel: Callable[..., tuple[NDArray[np.int64], NDArray[np.int64]]] = warp_energy
        self.cell_bits = cell_bits
        self.anchor_px = anchor_px
        spread = (events.x - anchor_px[0]) ** 2 + (events.y - anchor_px[1]) ** 2
        self.radius_px = max(float(np.sqrt(np.mean(spread))), 1.0)
        self.span_s = (events.span_us + 1) * 1e-6
        self._x, self._y = events.x.astype(np.int32), events.y.astype(np.int32)
        self._weight = events.p.astype(np.int32) * 2 - 1 if signed else np.ones(len(events), np.int32)
        self._slot = ((events.t - events.t[0]) * slots // (events.span_us + 1)).astype(np.int32)
        self._slot_s = ((np.arange(slots) + 0.5) / slots - 0.5) * self.span_s
        side = 1 << cell_bits
        self._margin = int(max(events.width, events.height) * _MARGIN_SHARE) // side + 2
        rows, columns = (-(-edge // side) + 1 + 2 * self._margin for edge in (events.height, events.width))
        self._image = np.zeros((_BATCH, rows, columns), np.int32)
        self._unit = float(EVENT_WEIGHT)
        self._still = max(float(self.variance([Twist(0.0, 0.0, 0.0)])[0]), 1e-12)

    def variance(self, twists: list[Twist]) -> NDArray[np.float64]:
        """Return the variance of the image under each twist, float64[m], in squared events a cell."""
        parts = [np.zeros(0)]
        for first in range(0, len(twists), _BATCH):
            total, energy = self._splat(twists[first : first + _BATCH])
            cells = self._image[0].size
            parts.append((energy / self._unit**2 - (total / self._unit) ** 2 / cells) / cells)
        return np.concatenate(parts)

    def gain(self, twists: list[Twist]) -> NDArray[np.float64]:
        """Return the variance under each twist over that at rest, float64[m]."""
        return self.variance(twists) / self._still

    def distance_px(self, one: Twist, other: Twist) -> float:
        """Return how far two twists part over the window, at the typical distance of an event from the anchor."""
        apart = np.subtract(one, other) * (1.0, 1.0, self.radius_px) * self.span_s
        return float(np.abs(apart).max())

    def _splat(self, twists: list[Twist]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        return self._kernel(
            self._x, self._y, self._weight, self._slot, self._warp(twists), self.cell_bits, self._margin, self._image
        )

    def _warp(self, twists: list[Twist]) -> NDArray[Any]:
        """Return the displacement int64[m, slots, 6] that rotates each slot to the middle of the window.

        With ``θ = −ωτ`` and the anchor ``q``: ``x' = q + R(θ)(x − q) + s``, where ``s`` tends to ``−v·τ`` as ω → 0.
        """
        vx, vy, omega = (column[:, None] for column in np.array(twists, np.float64).T)
        angle = omega * self._slot_s
        shrink, sine = np.cos(angle) - 1.0, -np.sin(angle)
        near = np.abs(angle) < 1e-9
        safe = np.where(near, 1.0, angle)
        along = np.where(near, -1.0, sine / safe) * self._slot_s
        across = np.where(near, 0.0, -shrink / safe) * self._slot_s
        qx, qy = self.anchor_px
        shift_x = -shrink * qx + sine * qy + along * vx - across * vy
        shift_y = -shrink * qy - sine * qx + along * vy + across * vx
        exact = np.stack([shrink, -sine, shift_x, sine, shrink, shift_y], axis=-1)
        return np.floor(exact * _SCALE + 0.5).astype(np.int64)
