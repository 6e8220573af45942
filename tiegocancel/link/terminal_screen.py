"""Draw a live run into a terminal: two pictures of half blocks side by side, and the numbers under them."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.link.screen_process import Picture, pictures

__all__ = ["half_blocks", "picture_of", "shrunk"]

_OFF, _NONE, _ON = np.array([37, 99, 171]), np.array([24, 28, 34]), np.array([216, 60, 80])
_TEXT_ROWS = 8


def picture_of(picture: Picture, width: int, height: int) -> Any:
    """Return what rich prints for a picture in a terminal of ``width`` × ``height`` characters."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    before, after, lines = picture
    columns, rows = max(width // 2 - 2, 8), max(height - _TEXT_ROWS, 4)
    table = Table.grid(padding=(0, 1))
    table.add_row(Text("before"), Text("after"))
    table.add_row(*(half_blocks(shrunk(image, columns, 2 * rows)) for image in (before, after)))
    return Group(table, *(Text(line, no_wrap=True, overflow="crop") for line in lines))


def shrunk(image: NDArray[np.int8], columns: int, rows: int) -> NDArray[np.int64]:
    """Return an image of at most ``columns`` × ``rows``, in proportion; each cell is the sum of the pixels in it."""
    height, width = image.shape
    scale = max(width / columns, height / rows, 1.0)
    down, across = ((np.arange(side) / scale).astype(int) for side in (height, width))
    wide = image.astype(np.int64)
    by_row = np.add.reduceat(wide, np.flatnonzero(np.diff(down, prepend=-1)), axis=0)
    return np.asarray(np.add.reduceat(by_row, np.flatnonzero(np.diff(across, prepend=-1)), axis=1))


def half_blocks(image: NDArray[np.int64]) -> Any:
    """Return an image as text, two rows of cells a line: ON red, OFF blue, the stronger the brighter."""
    from rich.color import Color
    from rich.style import Style
    from rich.text import Text

    if len(image) % 2:
        image = np.vstack([image, np.zeros((1, image.shape[1]), np.int64)])
    full = max(float(np.quantile(np.abs(image), 0.99)), 1.0)
    share = np.clip(np.abs(image) / full, 0.0, 1.0)[..., None]
    colours = (_NONE + share * (np.where((image > 0)[..., None], _ON, _OFF) - _NONE)).astype(int)
    text = Text(no_wrap=True)
    for upper, lower in zip(colours[::2].tolist(), colours[1::2].tolist(), strict=True):
        for top, bottom in zip(upper, lower, strict=True):
            text.append("▀", Style(color=Color.from_rgb(*top), bgcolor=Color.from_rgb(*bottom)))
        text.append("\n")
    text.rstrip()
    return text


def _show() -> None:
    """Be the screen, on the terminal of standard error: standard output stays free for data."""
    from rich.console import Console
    from rich.live import Live

    console = Console(stderr=True)
    with Live(console=console, auto_refresh=False, transient=True) as live:
        for picture in pictures():
            live.update(picture_of(picture, console.width, console.height), refresh=True)


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        _show()
