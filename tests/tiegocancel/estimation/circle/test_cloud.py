"""Keep a bounded cloud of the past."""

from __future__ import annotations

import numpy as np

from tiegocancel.estimation.circle.cloud import EventCloud


def column(first, count):
    return np.arange(first, first + count, dtype=np.uint16)


def test_cloud_holds_the_latest_slices_in_order():
    cloud = EventCloud(span_us=30, slice_events=4)
    for stop in (10, 20, 30, 40, 50):
        cloud.add(stop, column(stop, 2), column(0, 2))
    assert cloud.after(0, 100)[:, 0].tolist() == [30, 31, 40, 41, 50, 51]
    assert cloud.after(40, 100)[:, 0].tolist() == [50, 51]
    assert cloud.age_us(50) == 20


def test_slices_and_answers_are_thinned_evenly():
    cloud = EventCloud(span_us=1000, slice_events=4)
    cloud.add(10, column(0, 100), column(0, 100))
    assert cloud.after(0, 100)[:, 0].tolist() == [0, 25, 50, 75]
    assert cloud.after(0, 2)[:, 0].tolist() == [0, 50]


def test_empty_cloud_answers_with_no_points():
    cloud = EventCloud(span_us=1000, slice_events=4)
    cloud.add(10, column(0, 0), column(0, 0))
    assert cloud.after(0, 100).shape == (0, 2)
    assert cloud.age_us(99) == 0
