"""Turn events at sub-pixel places into a signed image (thesis, §5.8), and say how sharp an image is."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Sharpness", "gradient_energy", "raster", "variance"]

Sharpness = Literal["variance", "gradient"]

_FAR_PX = float(1 << 20)


def raster(
    x: ArrayLike, y: ArrayLike, weight: ArrayLike, *, width: int, height: int, nearest: bool = False
) -> NDArray[np.float64]:
    """Return the sum of weights float64[height, width] that events at ``x`` ``y`` (px, any fraction) leave on a pixel.

    ``weight`` is a whole number, +1 for ON and −1 for OFF. Bilinear: each event is shared by the four pixels around it
    and loses what falls beyond the image; ``nearest`` gives all of it to one pixel. Places count to 1/256 px.
    """
    from tiegocancel.kernels.splat import FRACTION_BITS, splat

    scale = float(1 << FRACTION_BITS)
    places = [
        np.floor(np.clip(np.asarray(column, np.float64), -_FAR_PX, _FAR_PX) * scale + 0.5).astype(np.int32)
        for column in (x, y)
    ]
    image = np.zeros((height, width), np.int64)
    if len(places[0]):
        weights = np.ascontiguousarray(weight, np.int32)
        splat(nearest=nearest, x=places[0], y=places[1], weight=weights, image=image)
    return image / scale**2


def variance(image: NDArray[np.float64]) -> float:
    """Return the variance of an image: the first objective of contrast maximisation."""
    return float(image.var())


def gradient_energy(image: NDArray[np.float64]) -> float:
    """Return the mean squared gradient of an image, by central differences: the second objective."""
    down, right = np.gradient(image)
    return float(np.mean(down * down + right * right))
