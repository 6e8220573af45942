"""Draw one window before and after (Fig. 7.6 and 7.8), and beside motion compensation (research question 3)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from tiegocancel.report import style
from tiegocancel.study.thesis.probe import Bench
from tiegocancel.study.thesis.qualitative import Panels
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["compensation", "qualitative"]

_DOTS = 60_000


def qualitative(bench: Bench, panels: Panels) -> Figure:
    """Draw scatter, signed images and histograms of one point, in the rows and columns of Fig. 7.6."""
    drawn = style.figure(11.0, 8.7)
    axes = drawn.subplots(3, 3, height_ratios=(1.0, 1.0, 0.55))
    view = _view(bench, panels)
    real, left = panels.real, panels.residual
    every = max(len(real) // _DOTS, 1)  # the same for all three, so that dots can be compared
    _scatter(axes[0, 0], real.x, real.y, real.p, f"real: {len(real):,} events", view, every)
    _scatter(
        axes[0, 1], panels.ahead_x, panels.ahead_y, 1 - panels.ahead_p,
        f"anti-events due: {len(panels.ahead_x):,}", view, every,
    )  # fmt: skip
    _scatter(axes[0, 2], left.x, left.y, left.p, f"residual: {len(left):,} ({1 - panels.ratio:.1%})", view, every)
    limit = max(float(np.percentile(np.abs(panels.original[panels.original != 0]), 98)), 1.0)
    for panel, image, title in (
        (axes[1, 0], panels.original, "signed image, all events"),
        (axes[1, 1], panels.combined, "events + all anti-events, bilinear"),
        (axes[1, 2], panels.left, "residual"),
    ):
        panel.imshow(image, cmap=style.SIGNED, vmin=-limit, vmax=limit, interpolation="nearest")
        panel.add_patch(
            Circle(bench.center_px, bench.radius_px, fill=False, color=style.MOVER, linewidth=1.0, linestyle="--")
        )
        _frame(panel, title, view)
    edges = np.arange(-0.25, 8.5, 0.5)
    for panel, image, title in zip(
        axes[2], (panels.original, panels.combined, panels.left), ("all events", "combined", "residual"), strict=True
    ):
        lit = np.abs(image[image != 0])
        panel.hist(np.minimum(lit, edges[-1] - 0.1), edges, color=style.RESIDUAL, alpha=0.85)
        panel.set_yscale("log")
        panel.set(
            xlabel="|signed count| of a pixel that has any",
            title=f"{title}: median {np.median(lit):.2g}" if len(lit) else title,
        )
        style.tidy(panel)
    axes[2, 0].set_ylabel("pixels")
    return drawn


def compensation(result: ThesisResult) -> Figure | None:
    """Draw the images of both methods and what each costs, as ratios of one run."""
    images = result.images
    if images is None or not result.comparisons:
        return None
    drawn = style.figure(11.0, 6.6)
    parts: Any = drawn.subfigures(2, 1, height_ratios=(1.25, 1.0))
    axes = parts[0].subplots(1, 4)
    first = result.comparisons[0]
    cx, cy = result.bench.center_px
    reach = 1.06 * result.bench.radius_px
    limit = max(float(np.percentile(np.abs(images.original[images.original != 0]), 98)), 1.0)
    for panel, name, words in zip(
        axes,
        ("original", "warped", "residual", "residual_zero"),
        (
            "as they are",
            "warped to the middle",
            f"residual, {1 - first.suppressed:.0%} of events",
            f"zero motion’s, {1 - first.suppressed_zero:.0%} of events",
        ),
        strict=True,
    ):
        panel.imshow(getattr(images, name), cmap=style.SIGNED, vmin=-limit, vmax=limit, interpolation="nearest")
        panel.set(xlim=(cx - reach, cx + reach), ylim=(cy + reach, cy - reach), xticks=[], yticks=[], title=words)
        panel.set_xlabel(f"variance ×{first.variance[name]:.2f}, gradient ×{first.gradient[name]:.2f}", fontsize=8)
    _costs(parts[1].subplots(1, 3), result)
    return drawn


def _costs(axes: Any, result: ThesisResult) -> None:
    """Draw seconds, bytes and latency, a bar each, on logarithmic axes."""
    names = ["contrast\nmaximised", "warp alone,\nmotion known", "streaming,\nmotion known"]
    colours = [style.NOISE, style.BEFORE, style.OFF]
    found = result.comparisons

    def mean(*fields: str) -> list[float]:
        return [float(np.mean([getattr(one, field) for one in found])) for field in fields]

    ms = [1000 * value for value in mean("fit_s", "warp_s", "cancel_s")]
    kib = [value / 1024 for value in mean("fit_bytes", "warp_bytes", "cancel_bytes")]
    fit_us = 1e6 * mean("fit_s")[0]
    batch_us, event_us = mean("latency_batch_us", "latency_event_us")
    # Contrast maximisation has the same wait, and its search on top.
    latency = [batch_us + fit_us, batch_us, event_us]
    for panel, values, title in (
        (axes[0], ms, "ms of work for a window"),
        (axes[1], kib, "KiB held"),
        (axes[2], latency, "µs from an event to its decision"),
    ):
        bars = panel.bar(names, values, color=colours, width=0.6)
        panel.bar_label(
            bars,
            [f"{value:,.{2 if value < 10 else 0}f}\n×{value / max(values[2], 1e-12):,.3g}" for value in values],
            fontsize=7,
            padding=2,
        )
        panel.set_yscale("log")
        panel.set_ylim(min(values) / 3, max(values) * 12)
        panel.set_title(title)
        panel.tick_params(axis="x", labelsize=7)
        style.tidy(panel)


def _scatter(
    axes: Axes,
    x: NDArray[np.generic],
    y: NDArray[np.generic],
    p: NDArray[np.uint8],
    title: str,
    view: tuple[float, float, float, float],
    every: int,
) -> None:
    some = slice(None, None, every)
    for polarity, colour in ((1, style.ON), (0, style.OFF)):
        chosen = p[some] == polarity
        axes.scatter(x[some][chosen], y[some][chosen], s=0.5, color=colour, linewidths=0)
    axes.set_aspect("equal")
    _frame(axes, title, view)


def _frame(axes: Axes, title: str, view: tuple[float, float, float, float]) -> None:
    axes.set_title(title, fontsize=9)
    axes.set(xticks=[], yticks=[], xlim=view[:2], ylim=(view[3], view[2]))


def _view(bench: Bench, panels: Panels) -> tuple[float, float, float, float]:
    """Return left, right, top and bottom: the disc with room around it, within the sensor."""
    (cx, cy), reach = bench.center_px, 1.25 * bench.radius_px
    width, height = panels.real.width, panels.real.height
    return (
        max(cx - 1.3 * reach, -0.5),
        min(cx + 1.3 * reach, width - 0.5),
        max(cy - reach, -0.5),
        min(cy + reach, height - 0.5),
    )
