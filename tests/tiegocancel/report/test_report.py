"""The report is one well-formed page that says what the numbers say, for any result down to a single event."""

from __future__ import annotations

import math
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import CancelConfig, Events, RotationTrajectory
from tiegocancel.estimation.diagnosis.diagnose import diagnose_rotation
from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.report import draw_figures, write_page
from tiegocancel.report.images import signed_counts
from tiegocancel.report.motion import draw_motion, motion_figure
from tiegocancel.report.plots import residual_profile
from tiegocancel.study import RunResult, Settings, judge, run_stream

VOID = {"meta", "img", "br", "link"}


class Outline(HTMLParser):
    """Check that tags nest, and collect the text."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text: list[str] = []
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [value or "" for name, value in attrs if name in ("src", "href")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def result_of(events: Events, horizon_us: int = 20, cancel: CancelConfig | None = None) -> RunResult:
    trajectory = RotationTrajectory.constant(center_px=(events.width / 2, events.height / 2), omega_rad_s=0.0)
    settings = Settings(cancel=cancel or CancelConfig(horizon_us=horizon_us, tolerance_us=5))
    result = run_stream([events], settings, trajectory)
    assert result is not None
    return result


def blinking(count: int, width: int, height: int, *, labelled: bool = False) -> Events:
    """One event every 20 µs at the same few pixels: everything is predicted by standing still."""
    rng = np.random.default_rng(0)
    x, y = rng.integers(0, width, 3), rng.integers(0, height, 3)
    index = np.arange(count) % 3
    label = np.arange(count) % 3 if labelled else None
    return Events(np.arange(count) // 3 * 20, x[index], y[index], index % 2, width, height, label)


@pytest.mark.parametrize(
    ("count", "width", "height"), [(1, 1, 1), (3, 1, 1), (50, 2, 9), (3000, 40, 30), (3000, 300, 5)]
)
@pytest.mark.parametrize("labelled", [False, True])
def test_figures_and_page_are_made_for_any_result(
    count: int, width: int, height: int, labelled: bool, tmp_path: Path
) -> None:
    result = result_of(blinking(count, width, height, labelled=labelled))
    drawings = draw_figures(result, tmp_path, np.ones((height, width), np.float32))
    for drawing in drawings:
        assert drawing.path.read_bytes().startswith(b"\x89PNG")
    page = tmp_path / "report.html"
    write_page(page, result, judge(result), drawings, title="<script>alert('a & b')</script>", notes=["<b>note</b>"])
    outline = Outline()
    outline.feed(page.read_text(encoding="utf-8"))
    assert outline.open == []
    assert "script" not in outline.open
    text = "".join(outline.text)
    assert "<script>alert('a & b')</script>" in text
    assert "<b>note</b>" in text
    assert judge(result).headline in text
    assert all(link.startswith("data:image/png;base64,") for link in outline.links)
    assert len(outline.links) == len(drawings)


def test_the_page_leads_with_the_ratio_and_its_controls(tmp_path: Path) -> None:
    result = result_of(blinking(3000, 40, 30))
    numbers = result.to_json()
    page = tmp_path / "report.html"
    write_page(page, result, judge(result), [], title="blinking")
    text = page.read_text(encoding="utf-8")
    ratio = f"{numbers['cancellation_ratio']:.1%}"
    control = f"{numbers['controls']['zero_motion']:.1%}"
    assert text.index(ratio) < text.index("zero motion</th>") < text.index("Operating point")
    assert control in text
    assert "shows nothing" in text


def test_the_page_says_what_a_selective_configuration_has_beyond_the_plain_rule(tmp_path: Path) -> None:
    cancel = CancelConfig(
        horizon_us=32, more_horizons_us=(64,), tolerance_us=0, early_us=8, late_us=16, tick_bits=3, bin_bits=1,
        set_bits=(3, 2), ways=4, carry=1, need=2, uses=0, least_shift_px=1.0, motion_at="gate",
    )  # fmt: skip
    page = tmp_path / "report.html"
    for config, shown in ((cancel, True), (None, False)):
        result = result_of(blinking(3000, 40, 30), cancel=config)
        write_page(page, result, judge(result), [], title="blinking")
        text = page.read_text(encoding="utf-8")
        assert ("selective rule" in text) == shown
        if shown:
            for words in (
                "need 2",
                "carry 1",
                "64 µs",
                "latched",
                "−8 to +16 µs",
                "8×4 sets of 4",
                "2×2 px",
                "gate opens",
            ):
                assert words in text


def test_the_style_sheet_survives_the_template(tmp_path: Path) -> None:
    result = result_of(blinking(10, 4, 4))
    page = tmp_path / "report.html"
    write_page(page, result, judge(result), [], title="t")
    text = page.read_text(encoding="utf-8")
    assert re.search(r"grid-template-columns: repeat\(\d, 1fr\)", text)
    assert "$" not in text


def test_signed_counts_are_on_minus_off() -> None:
    events = Events(np.zeros(4, int), np.array([0, 0, 2, 2]), np.array([1, 1, 0, 0]), np.array([1, 1, 0, 1]), 3, 2)
    assert signed_counts(events).tolist() == [[0, 0, 0], [2, 0, 0]]


def rows_of(count: int, **given: object) -> list[MotionEstimate]:
    """A steady turn whose first row is far off and says so."""
    sure = {"center_sigma_px": 1.0, "omega_sigma_rad_s": 0.05, "sharpness": 1.8} | given
    first = MotionEstimate(
        t_us=0,
        center_px=(900.0, -900.0),
        omega_rad_s=40.0,
        omega_sigma_rad_s=9.0,
        doubt="the centre is not constrained",
    )
    others = [MotionEstimate(t_us=10_000 * k, center_px=(60, 50), omega_rad_s=5.0, **sure) for k in range(1, count)]  # type: ignore[arg-type]
    return [first, *others]


def test_the_motion_is_drawn_on_the_scale_of_rows_that_nothing_is_said_against() -> None:
    figure = motion_figure(rows_of(20), RotationTrajectory.constant(center_px=(60.0, 50.0), omega_rad_s=5.0))
    assert figure is not None
    omega, x, y, deviation, sharpness = figure.axes
    for panel, value in ((omega, 5.0), (x, 60.0), (y, 50.0)):
        low, high = panel.get_ylim()
        assert low < value < high < value + 10
        assert "truth" in [line.get_label() for line in panel.lines]
    assert deviation.get_yscale() == "log"
    assert sharpness.get_xlabel() == "time since the first estimate (s)"
    assert omega.get_title(loc="left").startswith("20 estimates")


def test_a_motion_without_sharpness_has_no_panel_of_it_and_without_centre_no_figure(tmp_path: Path) -> None:
    figure = motion_figure(rows_of(5, sharpness=math.nan))
    assert figure is not None
    assert len(figure.axes) == 4
    lost = [MotionEstimate(t_us=0, center_px=(math.nan, math.nan), omega_rad_s=0.0, confident=False)]
    assert motion_figure(lost) is None
    assert not draw_motion(tmp_path / "m.png", lost)
    assert not (tmp_path / "m.png").exists()
    assert draw_motion(tmp_path / "m.png", [rows_of(2)[0]])
    assert (tmp_path / "m.png").exists()


def test_an_omega_that_passes_through_zero_keeps_the_deviations_readable() -> None:
    rows = [
        MotionEstimate(t_us=1000 * k, center_px=(6, 5), omega_rad_s=0.1 * (k - 10), omega_sigma_rad_s=0.05)
        for k in range(21)
    ]
    figure = motion_figure(rows)
    assert figure is not None
    low, high = figure.axes[3].get_ylim()
    assert 0.5 < low < high < 200.0


def test_the_residual_profile_shows_the_bias_and_what_it_would_look_like() -> None:
    rng = np.random.default_rng(3)
    count = 20_000
    t = np.sort(rng.integers(0, 100_000, count))
    point = rng.integers(0, 150, count)
    radius, angle = 55 * np.sqrt(rng.random(150))[point], (2 * np.pi * rng.random(150))[point] + 13.0 * t * 1e-6
    x, y = (np.floor(place + 0.5).astype(int) for place in (80 + radius * np.cos(angle), 60 + radius * np.sin(angle)))
    events = Events(t, x, y, point % 2, 160, 120)
    motion = RotationTrajectory.constant(center_px=(80.0, 60.0), omega_rad_s=12.0)  # 1 rad/s too slow
    config = CancelConfig(horizon_us=12_000)
    result = run_stream([events], Settings(cancel=config), motion)
    assert result is not None
    diagnosis = diagnose_rotation(events, motion, config)
    figure = residual_profile(result.residuals, diagnosis)
    assert figure is not None
    left = figure.axes[0]
    lines = {line.get_label(): line for line in left.lines}
    model = np.asarray(lines["model: wrong ω"].get_ydata())
    assert model[-1] == pytest.approx(12e-3 * np.asarray(lines["model: wrong ω"].get_xdata())[-1], rel=0.1)
    mean = np.asarray(lines["matches, along the ring: mean ± spread"].get_ydata())
    assert mean[-1] > 0.2  # the events run ahead of their predictions
    assert figure.get_suptitle() == diagnosis.text
    plain = residual_profile(result.residuals)
    assert plain is not None
    assert "model: wrong ω" not in [line.get_label() for line in plain.axes[0].lines]
    assert residual_profile(result_of(blinking(3, 40, 30)).residuals) is None
