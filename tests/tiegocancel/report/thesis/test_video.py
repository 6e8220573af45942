"""The video has a frame for every stretch, and finds a way without ffmpeg."""

from __future__ import annotations

import shutil
import stat
from pathlib import Path

import numpy as np
import pytest

from tiegocancel.events import Events
from tiegocancel.report.thesis.video import frames_of, write_video


def stream() -> tuple[Events, np.ndarray]:
    """Return an ON event a millisecond on the left half of 40×30 px; the odd ones are suppressed."""
    t = np.arange(0, 20_001, 1000)
    x = np.arange(len(t)) % 20
    events = Events(t, x, np.full(len(t), 7), np.ones(len(t), np.int64), 40, 30)
    return events, np.arange(len(t)) % 2 == 1


def test_there_is_a_frame_for_each_whole_stretch_and_both_sides_show_what_is_left() -> None:
    events, suppressed = stream()
    frames = list(frames_of(events, suppressed, frame_us=5000))
    assert len(frames) == 4
    for frame in frames:
        assert frame.shape == (30, 88, 3)
        coloured = (frame != 255).any(axis=2)
        left, right = coloured[:, :40].sum(), coloured[:, 48:].sum()
        assert left == 5
        assert right in (2, 3)


def test_without_ffmpeg_it_is_a_gif_that_moves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from PIL import Image

    monkeypatch.setattr(shutil, "which", lambda name: None)
    path = write_video(tmp_path, "film", *stream(), frame_us=5000, fps=5)
    assert path == tmp_path / "film.gif"
    with Image.open(path) as film:
        assert film.n_frames == 4
        assert film.info["duration"] == 200


def test_with_ffmpeg_it_is_an_mp4_of_the_same_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in for the program keeps what it is given, so that no codec is needed."""
    program = tmp_path / "ffmpeg"
    program.write_text('#!/bin/sh\nfor last; do :; done\necho "$@" > "$last.words"\ncat > "$last"\n', encoding="utf-8")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(shutil, "which", lambda name: str(program))
    path = write_video(tmp_path, "film", *stream(), frame_us=5000, fps=5)
    assert path == tmp_path / "film.mp4"
    assert path.read_bytes() == b"".join(frame.tobytes() for frame in frames_of(*stream(), frame_us=5000))
    words = (tmp_path / "film.mp4.words").read_text(encoding="utf-8")
    assert "-s 88x30" in words
    assert "-r 5" in words


def test_an_ffmpeg_that_fails_leaves_a_gif(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\nexit 1\n", encoding="utf-8")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(shutil, "which", lambda name: str(program))
    assert write_video(tmp_path, "film", *stream(), frame_us=5000, fps=5) == tmp_path / "film.gif"


def test_a_stretch_shorter_than_a_frame_has_no_video(tmp_path: Path) -> None:
    assert write_video(tmp_path, "film", *stream(), frame_us=50_000, fps=5) is None
    assert write_video(tmp_path, "film", Events.empty(4, 4), np.zeros(0, np.bool_), frame_us=5000, fps=5) is None
