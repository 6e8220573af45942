"""Write the high-pass video (§6.3.1): all events beside the residual, MP4 where ffmpeg is found, GIF otherwise."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.metrics.raster import raster
from tiegocancel.report import style

__all__ = ["frames_of", "write_video"]

_MOST_ACROSS_PX = 640
_FULL = 2.0
"""Events of one sign on a pixel of the video that show in full colour."""
_GAP_PX = 8


def write_video(
    folder: Path, name: str, events: Events, suppressed: NDArray[np.bool_], *, frame_us: int, fps: int
) -> Path | None:
    """Write ``name.mp4`` or ``name.gif``; return its path, ``None`` of a stretch without a whole frame.

    Left all events, right those not suppressed, signed and bilinear, ``frame_us`` of events a frame.
    """
    frames = list(frames_of(events, suppressed, frame_us=frame_us))
    if not frames:
        return None
    program = shutil.which("ffmpeg")
    if program is not None:
        path = folder / f"{name}.mp4"
        if _encoded(program, path, frames, fps):
            return path
        path.unlink(missing_ok=True)
    from PIL import Image

    path = folder / f"{name}.gif"
    images = [Image.fromarray(frame).quantize(64) for frame in frames]
    images[0].save(path, save_all=True, append_images=images[1:], duration=round(1000 / fps), loop=0, optimize=False)
    return path


def frames_of(events: Events, suppressed: NDArray[np.bool_], *, frame_us: int) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures uint8[rows, columns, 3] of even size, one for each whole ``frame_us``."""
    if not len(events):
        return
    block = max(-(-events.width // _MOST_ACROSS_PX), 1)
    width, height = -(-events.width // block), -(-events.height // block)
    starts = range(int(events.t[0]), int(events.t[-1]) - frame_us + 2, frame_us)
    for start_us in starts:
        first, last = np.searchsorted(events.t, [start_us, start_us + frame_us])
        part, gone = events[int(first) : int(last)], suppressed[first:last]
        sides = [_picture(part, block, width, height), _picture(part.select(~gone), block, width, height)]
        gap = np.full((height, _GAP_PX, 3), 200, np.uint8)
        frame = np.concatenate([sides[0], gap, sides[1]], axis=1)
        # Codecs of halved colour want even sides.
        yield np.ascontiguousarray(frame[: frame.shape[0] // 2 * 2, : frame.shape[1] // 2 * 2])


def _picture(events: Events, block: int, width: int, height: int) -> NDArray[np.uint8]:
    """Return one side: ON red, OFF blue, nothing white."""
    signs = events.p.astype(np.int32) * 2 - 1
    # A pixel of the video is `block` pixels wide; its centre lies between theirs.
    x, y = ((column + 0.5) / block - 0.5 for column in (events.x, events.y))
    image = np.clip(raster(x, y, signs, width=width, height=height) / _FULL, -1.0, 1.0)
    colours = np.array([to_rgb(style.OFF), (1.0, 1.0, 1.0), to_rgb(style.ON)])
    strength = np.abs(image)[..., None]
    shown = np.where(image[..., None] < 0, colours[0], colours[2]) * strength + colours[1] * (1.0 - strength)
    picture: NDArray[np.uint8] = np.rint(255 * shown).astype(np.uint8)
    return picture


def _encoded(program: str, path: Path, frames: list[NDArray[np.uint8]], fps: int) -> bool:
    """Hand the frames to ffmpeg; tell whether it made the file."""
    rows, columns, _ = frames[0].shape
    command = [
        program, "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{columns}x{rows}",
        "-r", str(fps), "-i", "-", "-pix_fmt", "yuv420p", "-movflags", "+faststart", str(path),
    ]  # fmt: skip
    try:
        done = subprocess.run(
            command, input=b"".join(frame.tobytes() for frame in frames), capture_output=True, check=False
        )
    except OSError:
        return False
    return done.returncode == 0 and path.exists()
