"""A run's numbers equal what whole-array arithmetic gives, whatever the chunks; controls and faults are reported."""

from __future__ import annotations

import itertools
import json
import os
import signal
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from tiegocancel import CancelConfig, Canceller, ConfigError, Events, InputError, MotionSchedule, RotationTrajectory
from tiegocancel.study import RunResult, Settings, judge, run_stream
from tiegocancel.study.settings import MotionSettings, ReportSettings

WIDTH, HEIGHT, CENTER, OMEGA = 160, 120, (80.0, 60.0), 12.0


def scene(seed: int = 3, *, labelled: bool = True) -> Events:
    """Forty turning markers, a mover on a line, and noise over 80 ms."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 80_000, 100)
    radius, angle = 8 + 45 * rng.random(40), 2 * np.pi * rng.random(40)
    turned = angle + OMEGA * t[:, None] * 1e-6
    x = np.floor(CENTER[0] + radius * np.cos(turned) + 0.5).astype(int)
    y = np.floor(CENTER[1] + radius * np.sin(turned) + 0.5).astype(int)
    fresh = np.ones_like(x, bool)
    fresh[1:] = (np.diff(x, axis=0) != 0) | (np.diff(y, axis=0) != 0)
    marker = np.broadcast_to(np.arange(40), x.shape)[fresh]
    mover_t = np.arange(0, 80_000, 1000)
    noise = 400
    columns = [
        np.concatenate([np.repeat(t, 40)[fresh.ravel()], mover_t, rng.integers(0, 80_000, noise)]),
        np.concatenate([x[fresh], 5 + mover_t // 600, rng.integers(0, WIDTH, noise)]),
        np.concatenate([y[fresh], np.full(80, 20), rng.integers(0, HEIGHT, noise)]),
        np.concatenate([marker % 2, np.ones(80, int), rng.integers(0, 2, noise)]),
    ]
    label = np.concatenate([np.zeros(fresh.sum(), int), np.ones(80, int), np.full(noise, 2)])
    order = np.argsort(columns[0], kind="stable")
    return Events(*(c[order] for c in columns), WIDTH, HEIGHT, label[order] if labelled else None)  # type: ignore[misc]


def settings(**report: object) -> Settings:
    return Settings(
        cancel=CancelConfig(horizon_us=12_000),
        report=ReportSettings(disc_radius_px=54.0, **report),  # type: ignore[arg-type]
    )


def run(events: Events, wanted: Settings, pieces: int = 1) -> RunResult:
    cuts = np.linspace(0, len(events), pieces + 1).astype(int)
    chunks = [events[a:b] for a, b in itertools.pairwise(cuts)]
    trajectory = RotationTrajectory.constant(center_px=CENTER, omega_rad_s=OMEGA)
    result = run_stream(chunks, wanted, trajectory)
    assert result is not None
    return result


def test_ratios_equal_whole_array_arithmetic() -> None:
    events, wanted = scene(), settings()
    numbers = run(events, wanted).to_json()
    motion = MotionSchedule.rotation(center_px=CENTER, omega_rad_s=OMEGA, horizon_us=12_000)
    decisions = Canceller(wanted.cancel, motion, width=WIDTH, height=HEIGHT).process(events)
    assert decisions.source is not None
    counted = events.t >= events.t[0] + 13_000
    used = np.zeros(len(events), bool)
    used[decisions.source[decisions.suppressed]] = True
    disc = np.hypot(events.x - CENTER[0], events.y - CENTER[1]) <= 54.0
    s = decisions.suppressed
    assert numbers["cancellation_ratio"] == s[counted].mean()
    assert numbers["cancellation_ratio_pairs"] == (s | used)[counted].mean()
    for name, where in (("disc", disc), ("background", ~disc)):
        region = numbers["regions"][name]
        assert region["events"] == (counted & where).sum()
        assert region["cancellation_ratio"] == s[counted & where].mean()
        assert region["cancellation_ratio_pairs"] == (s | used)[counted & where].mean()
    shares = [s[counted & (events.label == label)].mean() for label in (0, 1, 2)]
    assert list(numbers["selectivity"].values()) == [*shares, shares[0] - shares[1]]
    area = sum(np.hypot(x - CENTER[0], y - CENTER[1]) <= 54.0 for x in range(WIDTH) for y in range(HEIGHT))
    assert numbers["regions"]["disc"]["residual_per_px"] == (counted & disc & ~s).sum() / area
    assert numbers["warm_up"]["events_left_out"] == (~counted).sum()
    still = Canceller(wanted.cancel, MotionSchedule.still(), width=WIDTH, height=HEIGHT).process(events)
    assert numbers["controls"]["zero_motion"] == still.suppressed[counted].mean()
    json.dumps(numbers)


def test_displacements_are_event_minus_prediction() -> None:
    events, wanted = scene(), settings()
    result = run(events, wanted)
    motion = MotionSchedule.rotation(center_px=CENTER, omega_rad_s=OMEGA, horizon_us=12_000)
    decisions = Canceller(wanted.cancel, motion, width=WIDTH, height=HEIGHT).process(events)
    assert decisions.source is not None
    met = np.flatnonzero(decisions.suppressed & (events.t >= events.t[0] + 13_000))
    made = decisions.source[met]
    ahead_x, ahead_y = motion.predict(events.t[made], events.x[made], events.y[made])
    distance = np.hypot(events.x[met] - ahead_x, events.y[met] - ahead_y)
    found = result.displacement.summary()
    assert found["matches"] == len(met)
    assert found["mean_px"] == pytest.approx(distance.mean())
    assert found["p95_px"] == pytest.approx(np.quantile(distance, 0.95, method="inverted_cdf"))
    late = (events.t[met] - events.t[made] - 12_000).mean()
    assert found["mean_late_us"] == pytest.approx(late)


def test_cuts_between_chunks_change_no_number() -> None:
    events = scene()
    whole = run(events, settings()).to_json()
    for pieces in (2, 7, 300):
        parts = run(events, settings(), pieces).to_json()
        for numbers in (whole, parts):
            numbers["seconds"] = numbers["events_per_second"] = 0
        assert parts == whole
    small = run(events, settings(chunk_events=97)).to_json()
    small["seconds"] = small["events_per_second"] = 0
    assert small == whole


def test_the_shuffled_control_counts_as_many_events_as_the_main_run() -> None:
    result = run(scene(), settings())
    assert result.controls["time_shuffled"].share().events == result.tally.share().events


def test_a_recording_too_short_to_shuffle_is_told() -> None:
    assert not any("shuffled" in note for note in run(scene(), settings()).notes)
    short = run(scene().between(0, 20_000), settings())
    assert any("times were shuffled within 19.9 ms" in note for note in short.notes)


def test_a_disc_without_events_is_not_compared() -> None:
    trajectory = RotationTrajectory.constant(center_px=(-300.0, 60.0), omega_rad_s=0.3)
    wanted = Settings(cancel=CancelConfig(horizon_us=12_000), report=ReportSettings(disc_radius_px=5.0))
    result = run_stream([scene()], wanted, trajectory)
    assert result is not None
    assert result.lead_region is None
    verdict = judge(result)
    assert verdict.grade == "nothing"
    assert any(reason.startswith("Everywhere") for reason in verdict.reasons)


def test_no_share_and_no_selectivity_without_a_mover() -> None:
    events = scene()
    assert events.label is not None
    selectivity = run(events.select(events.label != 1), settings()).to_json()["selectivity"]
    assert selectivity["ego"] > 0.6
    assert selectivity["mover"] is None
    assert selectivity["j"] is None


def test_chance_is_a_rival_like_any_other() -> None:
    """Two halves of a sensor that take turns every horizon: only a shuffle makes events meet predictions."""
    t = np.arange(0, 300_000, 60)
    x = t // 5000 % 2 * 5 + np.arange(len(t)) % 5
    events = Events(t, x, np.zeros(len(t), int), np.ones(len(t), int), 10, 1)
    wanted = Settings(
        cancel=CancelConfig(horizon_us=5000, tolerance_us=1000, tolerance_px=0.0),
        report=ReportSettings(disc_radius_px=20.0),
    )
    result = run_stream([events], wanted, RotationTrajectory.constant(center_px=(5.0, 0.0), omega_rad_s=0.1))
    assert result is not None
    assert result.controls["time_shuffled"].share().ratio > result.tally.share().ratio
    verdict = judge(result)
    assert verdict.grade == "nothing"
    assert any("chance" in reason for reason in verdict.reasons)


def test_a_sink_that_fails_is_not_taken_for_the_input() -> None:
    class Full:
        def write(self, events: Events) -> None:
            raise ConfigError("no room")

    trajectory = RotationTrajectory.constant(center_px=CENTER, omega_rad_s=OMEGA)
    with pytest.raises(ConfigError, match="no room"):
        run_stream([scene()], settings(), trajectory, sink=Full())


def test_an_interrupt_is_heard_between_chunks() -> None:
    events = scene()

    def asked() -> Iterator[Events]:
        yield events[:800]
        os.kill(os.getpid(), signal.SIGINT)
        yield events[800:]

    trajectory = RotationTrajectory.constant(center_px=CENTER, omega_rad_s=OMEGA)
    kept: list[int] = []

    class Sink:
        def write(self, events: Events) -> None:
            kept.append(len(events))

    result = run_stream(asked(), settings(chunk_events=500), trajectory, sink=Sink())
    assert result is not None
    assert result.fault == "interrupted"
    assert result.counters.events < len(events)
    assert sum(kept) == result.counters.events - result.counters.suppressed


def test_true_motion_beats_every_control_and_keeps_the_mover() -> None:
    result = run(scene(), settings())
    numbers = result.to_json()
    ratio = numbers["regions"]["disc"]["cancellation_ratio"]
    assert ratio > 0.6
    for control in numbers["regions"]["disc"]["controls"].values():
        assert control < ratio - 0.25
    assert numbers["selectivity"]["mover"] < 0.2
    assert numbers["selectivity"]["j"] > 0.5
    assert judge(result).grade == "selective"


def test_a_horizon_inside_the_gate_is_said_to_show_nothing() -> None:
    wanted = Settings(cancel=CancelConfig(horizon_us=500), report=ReportSettings(disc_radius_px=54.0))
    verdict = judge(run(scene(), wanted))
    assert verdict.grade == "nothing"
    assert "shows nothing" in verdict.headline
    assert any("same place" in reason for reason in verdict.reasons)


def test_a_wrong_motion_is_said_to_be_wrong() -> None:
    trajectory = RotationTrajectory.constant(center_px=CENTER, omega_rad_s=-OMEGA)
    result = run_stream([scene()], settings(), trajectory)
    assert result is not None
    verdict = judge(result)
    assert verdict.grade == "nothing"
    assert any("check centre, speed and sign" in reason for reason in verdict.reasons)


def test_unlabelled_streams_have_no_selectivity_and_no_controls_no_verdict() -> None:
    result = run(scene(labelled=False), settings(controls=False))
    assert result.to_json()["selectivity"] is None
    assert result.to_json()["controls"] == {}
    assert judge(result).grade == "unknown"


def test_a_recording_shorter_than_the_warm_up_says_so() -> None:
    result = run(scene()[:200], settings())
    assert any("warm-up" in note for note in result.notes)
    assert result.to_json()["cancellation_ratio"] == 0.0
    assert judge(result).grade == "unknown"


def test_overflow_is_reported_with_the_capacity_that_would_do() -> None:
    wanted = Settings(
        cancel=CancelConfig(horizon_us=12_000, ring_capacity=20), report=ReportSettings(disc_radius_px=54.0)
    )
    result = run(scene(), wanted)
    assert result.counters.overflow > 0
    assert any("did not fit the ring of 20" in note for note in result.notes)


def test_float_path_agrees_with_the_integer_path_but_for_rounding() -> None:
    events = scene()
    integer = run(events, settings()).to_json()["cancellation_ratio"]
    wanted = Settings(
        cancel=CancelConfig(horizon_us=12_000),
        motion=MotionSettings(path="float"),
        report=ReportSettings(disc_radius_px=54.0),
    )
    assert run(events, wanted).to_json()["cancellation_ratio"] == pytest.approx(integer, abs=0.01)


def test_a_fault_in_the_stream_keeps_what_came_before_it() -> None:
    events = scene()

    def torn() -> Iterator[Events]:
        yield events[:1000]
        raise InputError("f.raw", "byte 12", "the file ends inside a word")

    kept: list[Events] = []

    class Sink:
        def write(self, events: Events) -> None:
            kept.append(events)

    trajectory = RotationTrajectory.constant(center_px=CENTER, omega_rad_s=OMEGA)
    result = run_stream(torn(), settings(), trajectory, sink=Sink())
    assert result is not None
    assert result.fault == "f.raw: byte 12: the file ends inside a word"
    assert sum(map(len, kept)) == 1000 - result.counters.suppressed
    assert run_stream([], settings(), trajectory) is None


def test_the_zero_motion_control_predicts_the_same_place_whatever_the_least_shift() -> None:
    events = scene()
    plain = run(events, settings())
    wanted = settings()
    shifted = run(events, replace(wanted, cancel=replace(wanted.cancel, least_shift_px=1.0)))
    assert shifted.controls["zero_motion"].share().ratio == plain.controls["zero_motion"].share().ratio > 0.0
