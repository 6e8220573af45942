"""Events that a filter removes are no residual and in no ratio; they are counted, and told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiegocancel import CancelConfig, ConfigError, Events, RotationTrajectory, write_events
from tiegocancel.cli import main
from tiegocancel.filters import FilterChain, FilterConfig
from tiegocancel.study import RunResult, Settings, run_stream
from tiegocancel.study.prefilter import Prefilter
from tiegocancel.study.settings import ReportSettings

CENTER, OMEGA = (80.0, 60.0), 13.0
HOT = FilterConfig(hot_events=10, hot_window_us=20_000)


@pytest.fixture(scope="module")
def hot_scene(turning_scene: Events) -> Events:
    """The turning scene and a pixel that fires every 20 µs."""
    count = 4_000
    columns = zip(
        (turning_scene.t, turning_scene.x, turning_scene.y, turning_scene.p),
        (np.arange(count) * 20, np.full(count, 5), np.full(count, 7), np.arange(count) % 2),
        strict=True,
    )
    t, x, y, p = (np.concatenate(pair).astype(np.int64) for pair in columns)
    order = np.argsort(t, kind="stable")
    return Events(t[order], x[order], y[order], p[order], 160, 120)


def decided(events: Events, chunk: int = 1 << 19, **tables: Any) -> RunResult:
    report = ReportSettings(disc_radius_px=60.0, chunk_events=chunk)
    motion = RotationTrajectory.constant(center_px=CENTER, omega_rad_s=OMEGA)
    cuts = [events[first : first + chunk] for first in range(0, len(events), chunk)]
    result = run_stream(cuts, Settings(cancel=CancelConfig(horizon_us=12_000), report=report, **tables), motion)
    assert result is not None
    return result


def timeless(result: RunResult) -> dict[str, Any]:
    return result.to_json() | {"seconds": 0, "events_per_second": 0}


@pytest.mark.parametrize("chunk", [97, 1 << 19])
def test_a_filtered_run_is_the_run_of_the_events_that_are_kept(hot_scene: Events, chunk: int) -> None:
    kept = hot_scene.select(FilterChain(HOT, width=160, height=120).process(hot_scene))
    found, expected = timeless(decided(hot_scene, chunk, filter=HOT)), timeless(decided(kept))
    numbers = found.pop("filter")
    assert expected.pop("filter") is None
    assert found == expected
    assert numbers["events"] == len(hot_scene)
    assert numbers["kept"] == found["events"] == len(kept)
    assert numbers["hot_pixel"] == len(hot_scene) - len(kept) > 3_500
    assert numbers["state_bits"]["hot_pixel"] == 160 * 120 * numbers["state_bits"]["time"]
    json.dumps(numbers)


def test_without_filters_the_chunks_pass_as_they_are(turning_scene: Events) -> None:
    prefilter = Prefilter(FilterConfig())
    assert next(iter(prefilter.kept([turning_scene]))) is turning_scene
    assert prefilter.counters is None


def test_filters_that_remove_everything_are_named(turning_scene: Events) -> None:
    lonely = turning_scene[:1]
    with pytest.raises(ConfigError, match=r"background\) removed all 1 events"):
        decided(lonely, filter=FilterConfig(background_us=100))


def test_flags_reach_run_and_motion(hot_scene: Events, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = tmp_path / "hot.npz"
    write_events(source, hot_scene)
    flags = ["--hot-events", "50", "--refractory-us", "20", "--json"]
    out = tmp_path / "out"
    motion = f"{CENTER[0]},{CENTER[1]},{OMEGA}"
    assert main(["run", str(source), "--motion", motion, "--no-figures", "--guard", "--out", str(out), *flags]) == 0
    numbers = json.loads(capsys.readouterr().out)
    manifest = json.loads((out / "manifest.json").read_text())
    assert numbers["filter"]["hot_pixel"] > 3_000
    assert numbers["guard"]["windows"] > 0
    assert manifest["settings"]["filter"]["hot_events"] == 50
    assert manifest["settings"]["guard"]["enabled"] is True
    assert manifest["results"]["filter"] == numbers["filter"]
    assert main(["motion", str(source), "--out", str(tmp_path / "m.csv"), "--no-figures", *flags]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["filter"] == numbers["filter"]
    assert found["events"] == numbers["events"]


def test_the_summary_tells_what_was_removed(
    hot_scene: Events, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, config = tmp_path / "hot.npz", tmp_path / "run.toml"
    write_events(source, hot_scene)
    config.write_text("[filter]\nhot_events = 10\nhot_window_us = 20000\n[guard]\nenabled = true\n")
    common = ["--motion", f"{CENTER[0]},{CENTER[1]},{OMEGA}", "--no-figures", "--config", str(config)]
    assert main(["run", str(source), "--out", str(tmp_path / "out"), *common]) == 0
    text = capsys.readouterr().out
    assert "events removed (hot pixels" in text
    assert "  guard        closed" in text
