"""Cut the analysis windows W1 … Wn out of a recording, with the events that come before each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.study.thesis.settings import WindowSettings

__all__ = ["Window", "cut_windows", "place_windows"]

_PAIRS = (0.50, 0.82, 0.90)
"""Where the thesis's pairs begin, as shares of its recording: 5.0, 8.2 and 9.0 of 10 s."""


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """``start_us ≤ t < stop_us`` is measured; ``events`` begin as long before as the recording and the study allow."""

    name: str
    events: Events
    start_us: int
    stop_us: int

    @property
    def isolated(self) -> Events:
        """The window cut out, as the thesis has it: no event knows what came before."""
        return self.events.between(self.start_us, self.stop_us)


def place_windows(first_us: int, last_us: int, settings: WindowSettings, lead_us: int) -> tuple[list[int], int]:
    """Return where the windows begin and how long they are, in µs.

    A recording too short for one window with ``lead_us`` before it is one window as a whole. Raise ``ConfigError`` for
    ``starts_s`` beyond the recording.
    """
    span_us, length_us = last_us - first_us, settings.length_us
    if settings.starts_s:
        starts = [round(start_s * 1e6) for start_s in settings.starts_s]
        beyond = [start_us for start_us in starts if not first_us <= start_us <= last_us]
        if beyond:
            raise ConfigError(
                f"[thesis.windows] starts_s: {beyond[0] / 1e6:g} s lies beyond the recording, which runs from "
                f"{first_us / 1e6:g} to {last_us / 1e6:g} s"
            )
        return sorted(starts), length_us
    if span_us < lead_us + length_us:
        return [first_us], min(length_us, span_us + 1)
    latest_us = last_us + 1 - length_us
    earliest_us = first_us + lead_us
    starts = []
    for number in range(settings.count):
        pair, second = divmod(number, 2)
        share = _PAIRS[pair % len(_PAIRS)] - 0.05 * (pair // len(_PAIRS))
        start_us = max(first_us + round(share * span_us), earliest_us) + second * length_us
        starts.append(min(start_us, latest_us))
    return sorted(dict.fromkeys(starts)), length_us


def cut_windows(
    chunks: Callable[[], Iterable[Events]], settings: WindowSettings, lead_us: int
) -> tuple[tuple[Window, ...], list[str]]:
    """Return the windows of a stream and what is to be said about them; no windows of a stream without events.

    ``chunks`` begins the stream anew whenever it is called: once to see how long it is, once to cut.
    """
    first_us = last_us = None
    for chunk in chunks():
        if len(chunk):
            first_us = int(chunk.t[0]) if first_us is None else first_us
            last_us = int(chunk.t[-1])
    if first_us is None or last_us is None:
        return (), []
    starts, length_us = place_windows(first_us, last_us, settings, lead_us)
    parts: list[list[Events]] = [[] for _ in starts]
    for chunk in chunks():
        for part, start_us in zip(parts, starts, strict=True):
            piece = chunk.between(start_us - lead_us, start_us + length_us)
            if len(piece):
                part.append(piece)
    windows = [
        Window(f"W{number}", Events.concatenate(part), start_us, start_us + length_us)
        for number, (part, start_us) in enumerate(zip(parts, starts, strict=True), 1)
        if part
    ]
    return tuple(windows), _notes(windows, first_us, lead_us)


def _notes(windows: Sequence[Window], first_us: int, lead_us: int) -> list[str]:
    """Say where the windows are, and what they are too short for."""
    if not windows:
        return ["no window holds an event"]
    places = ", ".join(f"{window.name} at {window.start_us / 1e6:.3f} s" for window in windows)
    length_ms = (windows[0].stop_us - windows[0].start_us) / 1000
    notes = [f"windows of {length_ms:g} ms: {places}"]
    early = [window.name for window in windows if window.start_us - lead_us < first_us]
    if early:
        notes.append(
            f"too little comes before {', '.join(early)} for the longest horizon and gate ({lead_us / 1000:g} ms): "
            "there the warm-up is left out of the window itself, and horizons longer than the window give nothing"
        )
    return notes
