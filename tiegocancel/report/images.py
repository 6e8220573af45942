"""Draw events as pictures: signed images before and after, and slices through time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from tiegocancel.events import EGO, MOVER, NOISE, Events
from tiegocancel.report import style
from tiegocancel.study.result import RunResult

__all__ = ["before_after", "scene", "signed_counts", "time_slices"]

_CAUSES = ((NOISE, "noise", style.NOISE), (EGO, "ego-motion", style.EGO), (MOVER, "mover", style.MOVER))
_PIXELS_ACROSS = 1500  # image pixels that a figure shows side by side


def signed_counts(events: Events) -> NDArray[np.int64]:
    """Return ON minus OFF events a pixel, int64[height, width]."""
    return _counts(events.select(events.p == 1)) - _counts(events.select(events.p == 0))


def scene(photograph: NDArray[np.float32], result: RunResult) -> Figure:
    """Draw the intensity float32[height, width] beside the signed events of the picture."""
    drawn = style.figure(10.5, 10.5 / 2 * result.height / result.width + 0.45)
    left, right = drawn.subplots(1, 2)
    extent = (-0.5, result.width - 0.5, result.height - 0.5, -0.5)
    left.imshow(photograph, cmap="gray", vmin=0, extent=extent)
    left.set_title("intensity")
    events = result.picture.events()
    if events is not None:
        block = max(round(result.width * 2 / _PIXELS_ACROSS), 1)
        image = _blocks(signed_counts(events), block)
        reach = (-0.5, image.shape[1] * block - 0.5, image.shape[0] * block - 0.5, -0.5)
        right.imshow(image, cmap=style.SIGNED, vmin=-2, vmax=2, extent=reach, interpolation="nearest")
        right.set_title(f"events of {events.span_us / 1000:.1f} ms")
    for panel in (left, right):
        panel.set(xticks=[], yticks=[], xlim=extent[:2], ylim=extent[2:])
    return drawn


def before_after(result: RunResult) -> Figure | None:
    """Draw the picture's stretch of time: all events, the residual, and the residual by cause where labelled."""
    events = result.picture.events()
    if events is None:
        return None
    residual = events.select(~result.picture.suppressed())
    panels = 2 + (residual.label is not None)
    left, right, top, bottom = _view(events, result)
    drawn = style.figure(10.5, (10.5 / panels - 0.2) * (bottom - top) / (right - left) + 0.5)
    axes = drawn.subplots(1, panels, squeeze=False)[0]
    block = max(round((right - left) * panels / _PIXELS_ACROSS), 1)
    images = [_blocks(signed_counts(part), block) for part in (events, residual)]
    lit = np.abs(images[0][images[0] != 0])
    limit = max(float(np.percentile(lit, 97)) if lit.size else 1.0, 1.0)
    span_ms = events.span_us / 1000
    for panel, image, part, name in zip(axes[:2], images, (events, residual), ("all events", "residual"), strict=True):
        extent = (-0.5, image.shape[1] * block - 0.5, image.shape[0] * block - 0.5, -0.5)
        panel.imshow(image, cmap=style.SIGNED, vmin=-limit, vmax=limit, extent=extent, interpolation="nearest")
        _frame(panel, result, f"{name}: {len(part):,} in {span_ms:.1f} ms")
    if residual.label is not None:
        colours, reach = _cause_image(residual, block)
        axes[2].imshow(colours, extent=reach, interpolation="nearest")
        for cause, name, colour in _CAUSES:
            count = int(np.count_nonzero(residual.label == cause))
            axes[2].plot([], [], "s", color=colour, label=f"{name} {count:,}")
        axes[2].legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=3, fontsize=7, handletextpad=0.1)
        _frame(axes[2], result, "residual by cause")
    for panel in axes:
        panel.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    return drawn


def _view(events: Events, result: RunResult) -> tuple[float, float, float, float]:
    """Return left, right, top and bottom of the part of the sensor where nearly all events are, in px."""
    edges: list[float] = []
    for column, side, center in zip(
        (events.x, events.y), (events.width, events.height), result.region.center_px, strict=True
    ):
        low, high = (float(value) for value in np.percentile(column, (0.5, 99.5)))
        if result.disc_seen:
            low, high = min(low, center - result.region.radius_px), max(high, center + result.region.radius_px)
        margin = 0.02 * (high - low) + 4
        edges += [max(low - margin, -0.5), min(high + margin, side - 0.5)]
    left, right, top, bottom = edges
    # Neither a sliver nor a tower: at least a third as high as wide, and the other way round.
    if bottom - top < (right - left) / 3:
        top, bottom = max(top - (right - left) / 6, -0.5), min(bottom + (right - left) / 6, events.height - 0.5)
    if right - left < bottom - top:
        left, right = max(left - (bottom - top) / 4, -0.5), min(right + (bottom - top) / 4, events.width - 0.5)
    return left, right, top, bottom


def _cause_image(events: Events, block: int) -> tuple[NDArray[np.float64], tuple[float, float, float, float]]:
    """Colour each block of pixels by the cause of most of its events, white where there are none."""
    assert events.label is not None
    counts = np.stack([_blocks(_counts(events.select(events.label == cause)), block) for cause, _, _ in _CAUSES])
    palette = np.array([to_rgb(colour) for _, _, colour in _CAUSES])
    image = np.where((counts.sum(axis=0) > 0)[..., None], palette[counts.argmax(axis=0)], 1.0)
    return image, (-0.5, image.shape[1] * block - 0.5, image.shape[0] * block - 0.5, -0.5)


def _counts(events: Events) -> NDArray[np.int64]:
    """Return events a pixel, int64[height, width]."""
    pixel = events.y.astype(np.intp) * events.width + events.x
    return np.bincount(pixel, minlength=events.width * events.height).reshape(events.height, events.width)


def _blocks(image: NDArray[np.int64], block: int) -> NDArray[np.int64]:
    """Sum blocks of ``block`` × ``block`` pixels, so that a single event survives a small picture."""
    rows, columns = (-(-side // block) for side in image.shape)
    padded = np.zeros((rows * block, columns * block), np.int64)
    padded[: image.shape[0], : image.shape[1]] = image
    summed: NDArray[np.int64] = padded.reshape(rows, block, columns, block).sum(axis=(1, 3))
    return summed


def time_slices(result: RunResult) -> Figure | None:
    """Draw column against time for the rows of the slice, all events beside the residual."""
    events = result.slice.events()
    if events is None or result.slice.rows is None:
        return None
    kept = ~result.slice.suppressed()
    drawn = style.figure(10.5, 3.8)
    axes = drawn.subplots(1, 2, sharex=True, sharey=True)
    size = float(np.clip(20_000 / len(events), 0.8, 6.0))
    low, high = result.slice.rows
    for panel, part, name in zip(axes, (events, events.select(kept)), ("all events", "residual"), strict=True):
        milliseconds = (part.t - events.t[0]) / 1000
        for polarity, colour in ((1, style.ON), (0, style.OFF)):
            chosen = part.p == polarity
            panel.scatter(milliseconds[chosen], part.x[chosen], s=size, color=colour, linewidths=0)
        panel.set_title(f"{name}, rows {low}–{high}: {len(part):,}")
        panel.set_xlabel("time (ms)")
        style.tidy(panel, grid=None)
    axes[0].set_ylabel("column x (px)")
    axes[0].set_ylim(*np.percentile(events.x, (0.5, 99.5)) + np.array([-8, 8]))
    return drawn


def _frame(axes: Axes, result: RunResult, title: str) -> None:
    """Take the ticks off an image and mark the disc, where there is one."""
    axes.set_title(title)
    axes.set_xticks([])
    axes.set_yticks([])
    if not result.disc_seen:
        return
    axes.add_patch(
        Circle(result.region.center_px, result.region.radius_px, fill=False, color=style.MUTED, linewidth=0.7, ls="--")
    )
