"""Cut a stream of chunks into chunks of one size, so that results and speed do not depend on who made them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from tiegocancel.events import Events

__all__ = ["rechunk"]


def rechunk(chunks: Iterable[Events], size: int) -> Iterator[Events]:
    """Yield chunks of exactly ``size`` events, the last one shorter.

    When ``chunks`` raises, what it had given is yielded first and the error passes on after it.
    """
    if size < 1:
        raise ValueError(f"size must be at least 1 event, not {size}")
    held: list[Events] = []
    count = 0
    source = iter(chunks)
    fault: BaseException | None = None
    while True:
        try:
            chunk = next(source)
        except StopIteration:
            break
        except (Exception, KeyboardInterrupt) as error:
            fault = error
            break
        held.append(chunk)
        count += len(chunk)
        if count >= size:
            whole = Events.concatenate(held)
            full = count - count % size
            for first in range(0, full, size):
                yield whole[first : first + size]
            held, count = [whole[full:]], count - full
    if count:
        yield Events.concatenate(held)
    if fault is not None:
        raise fault
