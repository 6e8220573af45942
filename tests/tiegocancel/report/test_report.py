"""The report is one well-formed page that says what the numbers say, for any result down to a single event."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import CancelConfig, Events, RotationTrajectory
from tiegocancel.report import draw_figures, write_page
from tiegocancel.report.images import signed_counts
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


def result_of(events: Events, horizon_us: int = 20) -> RunResult:
    trajectory = RotationTrajectory.constant(center_px=(events.width / 2, events.height / 2), omega_rad_s=0.0)
    settings = Settings(cancel=CancelConfig(horizon_us=horizon_us, tolerance_us=5))
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
