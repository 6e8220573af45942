"""Put a labelled mover into a recording that has none, so that its loss can be counted."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tiegocancel.events import EGO, MOVER, Events

__all__ = ["Injected", "inject_mover"]

_SIZE_SHARE, _REACH_SHARE = 0.15, 0.3


@dataclass(frozen=True, slots=True)
class Injected:
    """The merged stream, labelled, and how many events of the ``mover`` are in it."""

    events: Events
    mover: int
    note: str


def inject_mover(events: Events, *, speed_px_s: float, seed: int = 0) -> Injected:
    """Return the stream with the events of the built-in scenes' hand among its own.

    The hand runs at ``speed_px_s`` along a circle about the middle of the real events. It is simulated before a
    resting, blank background and merged by time: it hides nothing, and its pixels know neither the real contrast
    behind it nor the dead time after real events. Real events keep their labels, or become ego. Raise ``ValueError``
    for a stream without events.
    """
    if not len(events):
        raise ValueError("a mover needs events to be put among, and there are none")
    from tiegocancel.scene import simulate
    from tiegocancel.scene.config import SceneConfig
    from tiegocancel.scene.mover import MoverConfig
    from tiegocancel.scene.rig import RigConfig
    from tiegocancel.scene.sensor import SensorConfig

    x, y = events.x.astype(np.float64), events.y.astype(np.float64)
    middle = (float(x.mean()), float(y.mean()))
    spread_px = max(math.hypot(float(x.std()), float(y.std())), 2.0)
    scene = SceneConfig(
        width=events.width,
        height=events.height,
        rig=RigConfig(omega_rad_s=0.0, pages=False),
        mover=MoverConfig(
            speed_px_s=speed_px_s,
            size_px=max(_SIZE_SHARE * min(events.width, events.height), 8.0),
            arc_center_px=middle,
            arc_radius_px=max(2.0 * _REACH_SHARE * spread_px, 2.0),
        ),
        sensor=SensorConfig(noise_hz=0.0),
    )
    first_us = int(events.t[0])
    made = list(simulate(scene, duration_s=(events.span_us + 1) * 1e-6, seed=seed, start_us=first_us))
    hand = Events.concatenate([Events.empty(events.width, events.height, labelled=True), *made])
    assert hand.label is not None
    hand = hand.select((hand.label == MOVER) & (hand.t <= int(events.t[-1])))
    return Injected(
        events=_merged(events, hand),
        mover=len(hand),
        note=f"no mover is labelled: {len(hand):,} events of a simulated hand at {speed_px_s:.0f} px/s were put among "
        f"the {len(events):,} real ones, which count as ego; it hides nothing, and dead time after real events is "
        "ignored",
    )


def _merged(events: Events, hand: Events) -> Events:
    """Return both streams in the order of time, real events first among equals."""
    label = np.full(len(events), EGO, np.int8) if events.label is None else events.label
    t = np.concatenate([events.t, hand.t])
    order = np.argsort(t, kind="stable")
    return Events(
        t[order],
        np.concatenate([events.x, hand.x])[order],
        np.concatenate([events.y, hand.y])[order],
        np.concatenate([events.p, hand.p])[order],
        events.width,
        events.height,
        np.concatenate([label, np.full(len(hand), MOVER, np.int8)])[order],
    )
