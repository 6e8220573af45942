"""Undo, for a device to send, the exchange and mirroring of axes that its decoder does."""

from __future__ import annotations

import numpy as np

from tiegocancel.events import Events
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["to_device"]


def to_device(events: Events, options: ProtocolOptions) -> Events:
    """Return the events in the axes that ``options`` turn into those of ``events``."""
    if not (options.swap_xy or options.flip_x or options.flip_y):
        return events
    x, y = events.x, events.y
    if options.flip_x:
        x = (events.width - 1 - x.astype(np.int64)).astype(np.uint16)
    if options.flip_y:
        y = (events.height - 1 - y.astype(np.int64)).astype(np.uint16)
    if options.swap_xy:
        return Events(events.t, y, x, events.p, events.height, events.width, events.label)
    return Events(events.t, x, y, events.p, events.width, events.height, events.label)
