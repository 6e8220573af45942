"""The verb ``export`` as a user meets it: a folder that reads back, decides as ``run`` does, and says what it is."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tiegocancel.firmware_sim.export import read_vectors

from tiegocancel import MotionSchedule, read_events
from tiegocancel.cli import main
from tiegocancel.motion.schedule_file import write_schedule
from tiegocancel.study.beginning import BEYOND_WARM_UP

Invoke = Callable[..., tuple[int, str, list[str]]]
SHORT = ("--horizon-us", 3000, "--tolerance-us", 500)


@pytest.fixture(scope="module")
def disc(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small disc that turns fast for 25 ms, with its truth beside it."""
    folder = tmp_path_factory.mktemp("export")
    (folder / "disc.toml").write_text("[scene.rig]\nomega_rad_s = 14.4\n", encoding="utf-8")
    path = folder / "disc.npz"
    sizes = ("--width", "320", "--height", "180", "--config", str(folder / "disc.toml"))
    assert main(["simulate", str(path), "--duration", "0.025", "--seed", "2", *sizes]) == 0
    return path


def truth(disc: Path) -> tuple[object, ...]:
    return ("--motion", disc.with_name("disc.motion.csv"))


def test_the_folder_reads_back_and_the_manifest_lists_it(disc: Path, invoke: Invoke) -> None:
    code, out, _ = invoke("export", disc, *truth(disc), *SHORT, "--out", "v", "--json")
    numbers = json.loads(out)
    assert (code, numbers["out"]) == (0, "v")
    vectors = read_vectors(Path("v"))
    assert len(vectors.events) == numbers["events"]
    assert int(vectors.suppressed.sum()) == numbers["suppressed"] > 0
    manifest = json.loads(Path("v/manifest.json").read_text(encoding="utf-8"))
    assert sorted({path.name for path in Path("v").iterdir()} - {"manifest.json"}) == manifest["outputs"]
    assert manifest["results"]["files"] == numbers["files"]
    assert json.loads(Path("v/vectors.json").read_bytes())["command"] == manifest["command"]


def test_the_stretch_is_the_warm_up_and_what_can_be_suppressed_after_it(disc: Path, invoke: Invoke) -> None:
    code, out, _ = invoke("export", disc, *truth(disc), *SHORT)
    events = read_events(disc)
    vectors = read_vectors(Path("tiegocancel-vectors"))
    count = int(np.searchsorted(events.t, events.t[0] + 3500)) + BEYOND_WARM_UP
    assert code == 0
    assert vectors.events.t.tolist() == events.t[:count].tolist()
    assert out.splitlines()[-1] == "vectors: tiegocancel-vectors"


@pytest.mark.parametrize("rule", [("plain",), ("dense", "--need", 2)])
def test_decisions_are_those_of_a_run(disc: Path, invoke: Invoke, rule: tuple[object, ...]) -> None:
    given = (disc, *truth(disc), "--horizon-us", 10_240, "--preset", *rule)
    code, out, _ = invoke("export", *given, "--max-events", 10**9, "--json")
    assert code == 0
    rest = ("--no-controls", "--no-figures", "--no-diagnosis", "--residual", "npz", "--out", "r")
    assert invoke("run", *given, *rest)[0] == 0
    vectors = read_vectors(Path("tiegocancel-vectors"))
    residual = read_events("r/residual.npz")
    kept = vectors.events.select(~vectors.suppressed)
    assert 0 < len(residual) < json.loads(out)["events"]
    for name in ("t", "x", "y", "p"):
        assert np.array_equal(getattr(residual, name), getattr(kept, name))


def test_a_stretch_may_begin_later_and_begins_empty(disc: Path, invoke: Invoke) -> None:
    code, _, _ = invoke("export", disc, *truth(disc), *SHORT, "--from-us", 12_345, "--max-events", 2000, "--out", "v")
    vectors = read_vectors(Path("v"))
    events = read_events(disc).between(12_345, 1 << 40)[:2000]
    assert code == 0
    assert vectors.events.t.tolist() == events.t.tolist()
    assert not vectors.suppressed[vectors.events.t < events.t[0] + 2500].any()


def test_a_tracked_motion_is_that_of_the_events_up_to_there(disc: Path, invoke: Invoke) -> None:
    arguments = ("export", disc, "--motion", "track", "--window-us", 5000, "--step-us", 2000, *SHORT)
    code, _, _ = invoke(*arguments, "--from-us", 12_000, "--max-events", 12_000, "--out", "v")
    assert code == 0
    assert read_vectors(Path("v")).suppressed.any()


def test_a_core_adds_its_cycles_and_the_next_export_takes_them_away(disc: Path, invoke: Invoke) -> None:
    given = ("export", disc, *truth(disc), *SHORT, "--max-events", 3000, "--out", "v")
    code, out, err = invoke(*given, "--core-clock-mhz", 2)
    cycles = read_vectors(Path("v")).cycles
    assert code == 0
    assert cycles is not None
    assert cycles.dropped.any()
    assert "core         2 MHz" in out
    assert any(line.startswith("note: the core drops ") for line in err)
    assert invoke(*given)[0] == 0
    assert not Path("v/cycles.memh").exists()
    assert read_vectors(Path("v")).cycles is None


def test_the_core_is_that_of_the_configuration(disc: Path, invoke: Invoke) -> None:
    Path("core.toml").write_text('[core]\nlookup = "banked"\noverlap = "forward"\n', encoding="utf-8")
    given = ("export", disc, *truth(disc), *SHORT, "--max-events", 2000, "--core-clock-mhz", 50)
    assert invoke(*given, "--out", "serial")[0] == 0
    assert invoke(*given, "--out", "banked", "--config", "core.toml")[0] == 0
    serial, banked = (read_vectors(Path(name)).cycles for name in ("serial", "banked"))
    assert serial is not None
    assert banked is not None
    assert (serial.core.lookup, banked.core.lookup) == ("serial", "banked")
    assert serial.arrival.tolist() == banked.arrival.tolist()
    assert (banked.decided - banked.arrival).mean() < (serial.decided - serial.arrival).mean()


def test_vectors_that_test_nothing_are_told(disc: Path, invoke: Invoke) -> None:
    code, _, err = invoke("export", disc, *truth(disc), "--max-events", 100)
    assert code == 0
    assert any(line.startswith("note: nothing is suppressed within ") for line in err)
    code, _, err = invoke("export", disc, *truth(disc), *SHORT, "--guard")
    assert "note: the guard is left out: vectors are of the canceller alone" in err


@pytest.mark.parametrize(
    ("arguments", "code", "line"),
    [
        (("--max-events", 0), 2, "tiegocancel: --max-events: must be at least 1, not 0"),
        (("--core-clock-mhz", 0), 2, "tiegocancel: --core-clock-mhz: must be from 0.001 to 100000 MHz, not 0"),
        (("--core-clock-mhz", "nan"), 2, "tiegocancel: --core-clock-mhz: must be from 0.001 to 100000 MHz, not nan"),
        (("--motion-path", "float"), 2, "tiegocancel: --motion-path float: vectors are of the fixed-point schedule"),
        (("--from-us", 10**9), 1, "holds no events at 1000000000 µs or later (--from-us)"),
        (("--motion", "s.schedule", "--config", "two.toml"), 2, "tiegocancel: --motion s.schedule: the schedule was"),
        (("--out", "two.toml"), 2, "tiegocancel: --out two.toml: a file of that name is in the way"),
    ],
)
def test_what_cannot_be_exported_is_one_line(
    disc: Path, invoke: Invoke, arguments: tuple[object, ...], code: int, line: str
) -> None:
    given = (*truth(disc), *SHORT) if "--config" not in arguments else ()
    if not given:
        Path("two.toml").write_text("[cancel]\nhorizon_us = 3000\nmore_horizons_us = [6000]\n", encoding="utf-8")
        turn = MotionSchedule.rotation(center_px=(160, 90), omega_rad_s=14.4, horizon_us=3000)
        write_schedule(turn, "s.schedule")
    else:
        Path("two.toml").touch()
    told, out, err = invoke("export", disc, *given, *arguments)
    assert (told, out) == (code, "")
    assert line in err[-1]
    assert not Path("tiegocancel-vectors").exists()
