"""Cancel points that move as each kind of motion says: the point of having them."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel import AffineTrajectory, CameraIntrinsics, CameraTrajectory, CancelConfig, Canceller, Events

WIDTH, HEIGHT = 346, 260
LENS = CameraIntrinsics(fx=250.0, fy=250.0, cx=172.5, cy=129.5, distortion=(-0.3, 0.1), width=WIDTH, height=HEIGHT)
HORIZON_US = 20_000


def affine_places(motion, times, x, y):
    """Follow points from the origin of time by exact displacements."""
    rows = np.concatenate([motion.displacements(np.zeros(1, np.int64), int(time)) for time in times])
    a, b, c, d, e, f = (column[:, None] for column in rows.T)
    return x + a * x + b * y + c, y + d * x + e * y + f


def camera_places(motion, times, x, y):
    found = [motion.places(np.zeros(1, np.int64), x, y, int(time)) for time in times]
    return np.array([place[0] for place in found]), np.array([place[1] for place in found])


def points_of(places, motion, count=150, seed=3):
    """Return an event each millisecond from each point that moves along."""
    rng = np.random.default_rng(seed)
    times = np.arange(0, 100_000, 1000)
    x, y = places(motion, times, rng.uniform(0, WIDTH, count), rng.uniform(0, HEIGHT, count))
    t = np.broadcast_to(times[:, None], x.shape)
    column, row = np.floor(np.nan_to_num(x, nan=-9) + 0.5), np.floor(np.nan_to_num(y, nan=-9) + 0.5)
    seen = (column >= 0) & (column < WIDTH) & (row >= 0) & (row < HEIGHT)
    return Events(t[seen], column[seen].astype(int), row[seen].astype(int), np.ones(seen.sum(), int), WIDTH, HEIGHT)


@pytest.mark.parametrize(
    ("places", "motion"),
    [
        (affine_places, AffineTrajectory.from_parts((170, 130), pan_px_s=(400, -200))),
        (affine_places, AffineTrajectory.from_parts((170, 130), zoom_1_s=3.0)),
        (affine_places, AffineTrajectory.from_parts((100, 50), roll_rad_s=2.0, zoom_1_s=1.0, shear_1_s=(1.0, -2.0))),
        (camera_places, CameraTrajectory.constant((0.3, -0.5, 2.0), intrinsics=LENS)),
    ],
)
def test_true_motion_cancels_what_no_motion_and_the_reverse_do_not(places, motion):
    events = points_of(places, motion)
    config = CancelConfig(horizon_us=HORIZON_US, tolerance_us=400, tolerance_px=2.0, ring_capacity=1 << 14)
    late = events.t >= HORIZON_US

    def share(model):
        canceller = Canceller(config, model, width=WIDTH, height=HEIGHT)
        return float(canceller.process(events).suppressed[late].mean())

    assert share(motion.schedule(HORIZON_US)) > 0.9
    assert share(motion) > 0.9
    assert share(motion.stopped().schedule(HORIZON_US)) < 0.35
    assert share(motion.reversed().schedule(HORIZON_US)) < 0.35
