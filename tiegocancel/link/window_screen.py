"""Draw a live run into a window of matplotlib."""

from __future__ import annotations

import contextlib
import os
import sys
from typing import Any

from tiegocancel.link.screen_process import pictures

__all__ = ["has_display"]


def has_display() -> bool:
    """Tell whether a window could open here."""
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _show() -> int:
    """Be the window: draw each picture until they end or the window is closed."""
    import matplotlib as mpl
    import matplotlib.pyplot as plt

    from tiegocancel.report.style import SIGNED

    mpl.rcParams["toolbar"] = "None"
    drawn, axes = plt.subplots(1, 2, figsize=(10, 5.6), num="tiegocancel")
    if mpl.get_backend().lower() == "agg":
        sys.stderr.write("note: matplotlib finds no window toolkit (tkinter, Qt, GTK); --view terminal needs none\n")
        return 1
    images: list[Any] = []
    said: Any = None
    for before, after, lines in pictures():
        if not images:
            for place, image, title in zip(axes, (before, after), ("before", "after"), strict=True):
                place.set_title(title)
                place.set_axis_off()
                images.append(place.imshow(image, cmap=SIGNED, vmin=-2, vmax=2, interpolation="nearest"))
            said = drawn.text(0.02, 0.02, "", family="monospace", fontsize=9)
            drawn.subplots_adjust(left=0.01, right=0.99, top=0.93, bottom=0.24, wspace=0.02)
            drawn.show()
        for shown, image in zip(images, (before, after), strict=True):
            shown.set_data(image)
        said.set_text("\n".join(lines))
        drawn.canvas.draw_idle()
        drawn.canvas.flush_events()
        if not plt.fignum_exists(drawn.number):
            break
    return 0


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        sys.exit(_show())
