"""Keep in step with rows of bytes that nothing frames: accept what fits, search where it does not."""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.protocols.outbox import Outbox
from tiegocancel.link.protocols.protocol import LinkCounters, TextLine

__all__ = ["AlignedDecoder", "Kind", "Piece"]

_FEWEST_ROWS, _ROWS_BEHIND_TEXT, _MOST_ROWS = 16, 1024, 1 << 14
_JUNK_BITS, _LONG_JUNK_BITS = 10.0, 4.0
"""What a byte costs that belongs to nothing, and how much more beyond the length of a row."""
_BREACH_BITS, _AFTER_ROW_BITS = 16.0, 4.0
"""What it costs that such bytes begin, and how much more just behind a row that seemed good."""
_TEXT_BITS = 5.0
"""What a character of text costs."""
_LONGEST_TEXT = 200
_PRINTABLE = re.compile(rb"[\t\r\x20-\x7e]{0,201}")
_TEXT = re.compile(rb"[\t\r\x20-\x7e]{0,200}\n")

Kind = Literal["row", "text", "junk"]

Piece = tuple[Kind, int, float, Any]
"""What may stand at a place: its kind, its length in bytes, what it costs in bits, the state behind it."""

_Path = tuple[float, Any, tuple[Kind, int] | None]
"""The cheapest way to a place: its cost, the state there, and its first step, ``None`` while all was junk."""


class AlignedDecoder(ABC):
    """Decode rows of ``row_bytes`` each whose place in the stream nothing tells but their fit.

    A row that fits, followed by one that fits, is accepted: whole blocks at a time. Elsewhere the cheapest reading of
    the next ``look_rows`` rows is sought among all alignments, as a shortest path whose costs are bits: what a
    row that continues the stream is worth against bytes that belong to nothing. Its first step is taken. A decision
    depends on the bytes alone, never on how they were cut; the last row waits for the one behind it or :meth:`settle`.

    A protocol implements :meth:`_fits`, :meth:`_take` and :meth:`_pieces`, and may implement the others.
    """

    row_bytes: int
    look_rows: int = 5
    look_far_rows: int = 20

    def __init__(self, options: ProtocolOptions, *, width: int, height: int) -> None:
        self.options = options
        self.width = options.width or width
        self.height = options.height or height
        self.counters = LinkCounters()
        self._outbox = Outbox(self.width, self.height, options)
        self._held = b""
        self._rows_at_once = _MOST_ROWS
        self._undecided = -1
        self._in_step = True

    def feed(self, data: bytes) -> Events:
        """Take bytes; return the events that are complete and confirmed."""
        self.counters.bytes += len(data)
        self._held = self._held + data if self._held else bytes(data)
        return self._decode(final=False)

    def settle(self) -> Events:
        """Return what waited for confirmation; half a row or line goes on waiting for its rest."""
        return self._decode(final=True)

    def take_lines(self) -> list[TextLine]:
        """Return and forget the text lines that came since the last call."""
        return self._outbox.take_lines()

    @abstractmethod
    def _fits(self, rows: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Return which of ``rows`` [n, row_bytes] continue the stream, each behind the one before it.

        Set ``_undecided`` to the row that only rows behind these can decide, −1 where there is none.
        """

    @abstractmethod
    def _take(self, rows: NDArray[np.uint8], *, searched: bool) -> None:
        """Accept ``rows``: put their events out, bring the state up to date."""

    @abstractmethod
    def _state(self) -> Any:
        """Return what :meth:`_pieces` needs to know of what was accepted."""

    @abstractmethod
    def _pieces(self, data: bytes, place: int, state: Any) -> list[Piece]:
        """Return what may stand at ``place``, behind ``state``."""

    def _waits(self, data: bytes, place: int) -> bool:
        """Tell whether more bytes are needed before anything can be said of ``place``."""
        return False

    def _is_whole_text(self, text: bytes) -> bool:
        """Tell whether text has its end, or was cut where the search stopped looking."""
        return text.endswith(b"\n")

    def _rest_of_text(self, data: bytes, place: int) -> tuple[Kind, int]:
        """Find the end of text that was cut; nothing yet where it may still come, junk where it is none."""
        if line := _TEXT.match(data, place):
            return "text", len(line[0])
        length = _printable_bytes(data, place)
        if place + length == len(data) and length <= _LONGEST_TEXT:
            return "text", 0
        return "junk", max(length, 1)

    def _text_piece(self, data: bytes, place: int, state: Any) -> list[Piece]:
        """Return the text at ``place``, up to its end or that of ``data``; none where there is none."""
        length = _printable_bytes(data, place)
        if data[place + length : place + length + 1] == b"\n":
            length += 1
        elif not length or place + length < len(data):
            return []
        return [("text", length, 6.0 + _TEXT_BITS * length, state)]

    def _text_waits(self, data: bytes, place: int) -> bool:
        """Tell whether all from ``place`` on may be text whose end is to come."""
        length = _printable_bytes(data, place)
        return 0 < length <= _LONGEST_TEXT and place + length == len(data)

    def _plainly(self, data: bytes, place: int) -> tuple[Kind, int] | None:
        """Return what stands at ``place`` where that needs no search: whole text, or a good row before it."""
        return None

    def _is_wild(self, row: bytes) -> bool:
        """Tell whether ``row`` would change the state so much that it is looked at again, ``look_far_rows`` far."""
        return False

    def _goes_on(self, rows: bytes) -> bool:
        """Tell whether the rows behind the first go on from it, or rather from what was before."""
        return True

    def _take_text(self, line: bytes) -> None:
        """Accept a line of text, its end included; a protocol without text never comes here."""
        raise NotImplementedError(f"{type(self).__name__} has no text")

    def _breach(self) -> None:
        """Forget what the bytes that were passed over may have changed."""
        return

    def _decode(self, *, final: bool) -> Events:
        data = self._held
        bytes_ = np.frombuffer(data, np.uint8)
        place = 0
        while place < len(data):
            rows = (len(data) - place) // self.row_bytes
            if not rows:
                # Less than a row: only whole text can be told.
                if (plain := self._plainly(data, place)) is None or plain[0] != "text":
                    break
                self._take_text(data[place : place + plain[1]])
                place += plain[1]
                continue
            count = min(rows, self._rows_at_once)
            block = bytes_[place : place + count * self.row_bytes].reshape(count, self.row_bytes)
            fits = self._fits(block)
            good = count if fits.all() else int(np.argmin(fits))
            # The last row that fits is confirmed by the next one; at the end of a silent line by nothing more.
            sure = good if final and good == rows else max(good - 1, 0)
            if sure:
                self._accept(block[:sure], searched=False)
                place += sure * self.row_bytes
            if good == count or (good == self._undecided and not (final and count == rows)):
                if count == rows:
                    break
                self._rows_at_once = min(self._rows_at_once * 4, _MOST_ROWS)
                continue
            self._rows_at_once = _FEWEST_ROWS
            step = self._search(data, place, final=final)
            if not step:
                break
            place += step
        if place:
            self._held = data[place:]
        return self._outbox.take(self.counters)

    def _accept(self, rows: NDArray[np.uint8], *, searched: bool) -> None:
        if not self._in_step:
            self._in_step = True
            self.counters.resyncs += 1
        self._take(rows, searched=searched)

    def _search(self, data: bytes, place: int, *, final: bool) -> int:
        """Take the first step of the cheapest reading from ``place``; return its length, 0 to wait for more bytes."""
        if self._waits(data, place):
            return 0
        end = place + self.look_rows * self.row_bytes
        plain = self._plainly(data, place)
        if plain is None and len(data) < end and not final:
            return 0
        # Where too little follows to weigh, an event alone behind a long pause is no cheaper than a spoilt one.
        lone = len(data) < end and self._in_step and self._only_rows(data, place)
        if plain is None and not lone and len(data) < end and self._is_wild(data[place : place + self.row_bytes]):
            return 0
        end = min(end, len(data))
        kind, length = plain or self._cheapest(data[place:end], end - place)
        if kind == "junk" and lone:
            kind, length = "row", self.row_bytes
        if kind == "row" and not lone and self._is_wild(data[place : place + length]):
            end = place + self.look_far_rows * self.row_bytes
            if len(data) < end:
                # Not even a silent line decides this.
                return 0
            kind, length = self._cheapest(data[place:end], end - place)
        if kind == "row" and not self._goes_on(data[place:end]):
            kind, length = "junk", self.row_bytes
        if kind == "text" and not self._is_whole_text(data[place : place + length]):
            kind, length = self._rest_of_text(data, place)
        if kind == "row":
            self._accept(np.frombuffer(data, np.uint8, length, place).reshape(1, length), searched=True)
        elif kind == "text" and length:
            self._take_text(data[place : place + length])
            self._rows_at_once = _ROWS_BEHIND_TEXT
        elif kind == "junk":
            self.counters.bad_bytes += length
            self._in_step = False
            self._breach()
        return length

    def _only_rows(self, data: bytes, place: int) -> bool:
        """Tell whether all that stands from ``place`` on may be rows, the first of them not out of time."""
        state = self._state()
        if self._is_wild(data[place : place + self.row_bytes]) and self._doubts_pauses():
            return False
        for at in range(place, len(data) - self.row_bytes + 1, self.row_bytes):
            rows = [piece for piece in self._pieces(data, at, state) if piece[0] == "row"]
            if not rows:
                return False
            state = rows[0][3]
        return True

    def _doubts_pauses(self) -> bool:
        """Tell whether a step in time can be too long to be a pause."""
        return True

    def _cheapest(self, data: bytes, span: int) -> tuple[Kind, int]:
        """Return the first step of the cheapest reading of the first ``span`` bytes of ``data``.

        ``behind`` holds the cheapest ways to each byte that end with a piece, ``within`` those that end with a byte
        that belongs to nothing: going on so costs less there. No byte costs less than ``least``, which prunes.
        """
        least, look = self._least_bits(), self._pieces
        last = span - self.row_bytes
        behind: list[list[_Path]] = [[] for _ in range(span + 1)]
        within: list[list[_Path]] = [[] for _ in range(span + 1)]
        behind[0].append((0.0, self._state(), None))
        best_bits = math.inf
        best: tuple[Kind, int] = ("junk", 1)
        for at in range(span + 1):
            left = least * (span - at)
            for paths in (behind[at], within[at]):
                for bits, state, first in paths:
                    if bits + left >= best_bits:
                        continue
                    if at > last and at:
                        best_bits, best = bits + left, first or ("junk", at)
                        continue
                    for kind, length, piece_bits, behind_it in look(data, at, state):
                        target, cost = at + length, bits + piece_bits
                        step = first or (("junk", at) if at else (kind, length))
                        if target < span:
                            _offer(behind[target], (cost, behind_it, step))
                            continue
                        # Text may reach beyond the window: what stands there does not count.
                        cost -= (target - span) * _TEXT_BITS
                        if cost < best_bits:
                            best_bits, best = cost, step
                    junk = _JUNK_BITS + (_LONG_JUNK_BITS if first is None and at > self.row_bytes else 0.0)
                    if paths is behind[at]:
                        junk += _BREACH_BITS + (_AFTER_ROW_BITS if at else 0.0)
                    _offer(within[at + 1], (bits + junk, state, first))
        return best

    @abstractmethod
    def _least_bits(self) -> float:
        """Return what a byte costs at least: that of a row which continues the stream as well as can be."""


def _offer(paths: list[_Path], path: _Path) -> None:
    """Keep ``path`` if it is among the two cheapest of different states: a spoilt state shows its cost only later."""
    for index, other in enumerate(paths):
        if other[1] == path[1]:
            if path[0] < other[0]:
                paths[index] = path
            return
    if len(paths) < 2:
        paths.append(path)
    elif path[0] < (worse := max(paths, key=_bits))[0]:
        paths[paths.index(worse)] = path


def _bits(path: _Path) -> float:
    return path[0]


def _printable_bytes(data: bytes, place: int) -> int:
    """Return how many characters of text follow from ``place`` on, 201 at most."""
    found = _PRINTABLE.match(data, place)
    return found.end() - place if found else 0
