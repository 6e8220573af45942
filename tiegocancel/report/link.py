"""Draw what a stream asks of a line, before and after cancellation."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tiegocancel.report.style import BEFORE, INK, RESIDUAL, STYLE, figure, tidy

__all__ = ["link_figure"]

_MOST_POINTS = 2000


def link_figure(before: NDArray[np.float64], after: NDArray[np.float64], line_bytes_per_s: float) -> Figure:
    """Return demand against time: ``before`` and ``after`` in bytes a millisecond, float64[ms] each.

    Long recordings show the most demanding millisecond of each stretch, so that no peak is drawn away.
    """
    drawn = figure(7.0, 3.0)
    with rc_context(STYLE):
        axes = drawn.add_subplot()
        for profile, colour, name in ((before, BEFORE, "all events"), (after, RESIDUAL, "after cancellation")):
            step = max(-(-len(profile) // _MOST_POINTS), 1)
            padded = np.concatenate([profile, np.zeros(-len(profile) % step)])
            peaks = padded.reshape(-1, step).max(axis=1) * 8e-3
            axes.step(np.arange(len(peaks)) * step * 1e-3, peaks, where="post", color=colour, linewidth=1.0, label=name)
        axes.axhline(line_bytes_per_s * 8e-6, color=INK, linewidth=1.0, linestyle="--", label="what the line carries")
        axes.set_xlabel("time (s)")
        axes.set_ylabel("demand (Mbit/s)")
        axes.set_ylim(bottom=0.0)
        axes.set_title("What the stream asks of the line")
        axes.legend(loc="upper right")
        tidy(axes)
    return drawn
