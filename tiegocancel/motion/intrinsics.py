"""Hold the intrinsic calibration of a camera: focal lengths, principal point and the distortion of its lens."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tiegocancel.events import MAX_SIDE_PX
from tiegocancel.motion.lens import COEFFICIENTS, LensModel, bend, straighten

__all__ = ["CameraIntrinsics"]

_MAX_PX = 1e6
_MAX_COEFFICIENT = 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraIntrinsics:
    """Map between directions and pixels; the centre of the first pixel is (0, 0), x goes right and y down.

    ``fx``, ``fy`` and ``cx``, ``cy`` in px; ``distortion`` the coefficients of ``model`` (see
    :mod:`tiegocancel.motion.lens`): ``radtan`` k1 k2 p1 p2 k3, ``equidistant`` k1 k2 k3 k4; trailing zeros may be left
    out, and none at all is a pinhole (``radtan``) or the ideal fisheye (``equidistant``). ``width`` and ``height`` in
    px where the calibration says them. Raise ``ValueError`` naming field and value.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    model: LensModel = "radtan"
    distortion: tuple[float, ...] = ()
    width: int | None = None
    height: int | None = None

    def __post_init__(self) -> None:
        for name in ("fx", "fy"):
            # Written with "not", because a comparison with NaN is false.
            if not 0.0 < getattr(self, name) <= _MAX_PX:
                raise ValueError(f"{name} must be positive and at most {_MAX_PX:g} px, not {getattr(self, name)!r}")
        for name in ("cx", "cy"):
            if not abs(getattr(self, name)) <= _MAX_PX:
                raise ValueError(f"{name} must be within ±{_MAX_PX:g} px, not {getattr(self, name)!r}")
        if self.model not in get_args(LensModel):
            raise ValueError(f"model must be radtan or equidistant, not {self.model!r}")
        names = COEFFICIENTS[self.model]
        given = tuple(float(value) for value in self.distortion)
        if len(given) > len(names):
            raise ValueError(f"distortion must be at most {len(names)} numbers ({' '.join(names)}), not {len(given)}")
        for name, value in zip(names, given, strict=False):
            if not isfinite(value) or abs(value) > _MAX_COEFFICIENT:
                raise ValueError(f"distortion {name} must be finite and within ±{_MAX_COEFFICIENT:g}, not {value!r}")
        object.__setattr__(self, "distortion", given + (0.0,) * (len(names) - len(given)))
        for name in ("width", "height"):
            side = getattr(self, name)
            if side is not None and not 1 <= side <= MAX_SIDE_PX:
                raise ValueError(f"{name} must be from 1 to {MAX_SIDE_PX} px, not {side!r}")

    @classmethod
    def from_file(cls, path: str | Path) -> CameraIntrinsics:
        """Read TOML of ours, a line of numbers, Kalibr's camchain or ROS camera_info; told by the suffix.

        Formats and faults are those of :mod:`tiegocancel.motion.calibration_file`.
        """
        from tiegocancel.motion.calibration_file import read_calibration

        return read_calibration(path)

    @property
    def is_pinhole(self) -> bool:
        """Tell whether straight lines stay straight."""
        return self.model == "radtan" and not any(self.distortion)

    def pinhole(self) -> CameraIntrinsics:
        """Return the same camera without its distortion: that of coordinates that were undistorted."""
        return replace(self, model="radtan", distortion=())

    def directions(self, x_px: ArrayLike, y_px: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return ``X/Z`` and ``Y/Z`` float64[n] of what is seen at pixels float64[n]; NaN beyond the lens's field."""
        x, y = ((np.asarray(v, np.float64) - c) / f for v, c, f in ((x_px, self.cx, self.fx), (y_px, self.cy, self.fy)))
        return (x, y) if self.is_pinhole else straighten(self.model, self.distortion, x, y)

    def pixels(self, x: ArrayLike, y: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the pixels float64[n] at which the directions ``X/Z``, ``Y/Z`` are seen; NaN beyond the field."""
        across, down = np.asarray(x, np.float64), np.asarray(y, np.float64)
        if not self.is_pinhole:
            across, down = bend(self.model, self.distortion, across, down)
        return self.cx + self.fx * across, self.cy + self.fy * down

    def undistort(self, x_px: ArrayLike, y_px: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return where a pinhole of the same ``fx fy cx cy`` would show what is seen at the pixels, float64[n] each.

        Exact to 10^-6 px; NaN beyond the lens's field.
        """
        x, y = self.directions(x_px, y_px)
        return self.cx + self.fx * x, self.cy + self.fy * y

    def distort(self, x_px: ArrayLike, y_px: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return where the lens shows what a pinhole shows at the pixels: the inverse of :meth:`undistort`."""
        x, y = ((np.asarray(v, np.float64) - c) / f for v, c, f in ((x_px, self.cx, self.fx), (y_px, self.cy, self.fy)))
        return self.pixels(x, y)
