"""Understand every form of ``--motion`` and refuse the rest in one line."""

from __future__ import annotations

import os

import pytest

from tiegocancel.errors import ConfigError, InputError
from tiegocancel.estimation.source import trajectory_from


def never():
    raise AssertionError("events were read although the motion is given")


def parse(text, sample=never):
    return trajectory_from(text, sample=sample, width=320, height=240)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("150,110,3.6", ((150.0, 110.0), 3.6)),
        (" 150.5 , 110 ,-3.6 ", ((150.5, 110.0), -3.6)),
        ("1.5e2,110,0", ((150.0, 110.0), 0.0)),
    ],
)
def test_three_numbers_are_a_constant_rotation(text, expected):
    trajectory, fit = parse(text)
    assert trajectory.mean() == expected
    assert (trajectory.source, trajectory.notes, fit) == ("constant", (), None)


def test_centre_outside_the_sensor_is_allowed_and_noted():
    trajectory, _ = parse("-100,110,3.6")
    assert "outside the sensor of 320 × 240 px" in trajectory.notes[0]


@pytest.mark.parametrize("text", ["fit", "FIT", " fit "])
def test_fit_reads_the_sample_and_returns_its_fit(turning, text):
    trajectory, fit = parse(text, lambda: turning(count=8000))
    assert trajectory.source == "fit"
    assert fit is not None
    assert trajectory.mean() == (fit.center_px, fit.omega_rad_s)
    assert fit.omega_rad_s == pytest.approx(5.0, rel=0.02)


@pytest.mark.parametrize("name", ["motion.csv", "1,2,3", "a,2.csv"])
def test_an_existing_file_is_read_whatever_its_name(tmp_path, monkeypatch, name):
    (tmp_path / name).write_text("timestamp,center_x,center_y,omega_rad_s\n0,1,2,3\n1,2,3,4\n")
    monkeypatch.chdir(tmp_path)
    trajectory, fit = parse(name)
    assert len(trajectory) == 2
    assert (trajectory.source, fit) == (name, None)


def test_a_broken_file_is_an_input_error(tmp_path):
    broken = tmp_path / "motion.csv"
    broken.write_text("timestamp,center_x\n")
    with pytest.raises(InputError, match="lacks the column"):
        parse(os.fspath(broken))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "no such file"),
        ("none.csv", "no such file"),
        ("fit!", "no such file"),
        ("1,2", "2 numbers"),
        ("1,2,3,4", "4 numbers"),
        ("1,2,three", "OMEGA is 'three', not a number"),
        ("1,,3", "CY is '', not a number"),
        ("nan,2,3", "CX is nan"),
        ("1,2,inf", "OMEGA is inf"),
        ("1,2,1e9", "OMEGA is 1e9"),
        ("1e9,2,3", "CX is 1e9"),
        ("5", "1 number"),
        ("a\0b", "no such file"),
        ("x" * 5000, "no such file"),
    ],
)
def test_anything_else_is_refused_with_flag_value_and_forms(text, problem, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError) as caught:
        parse(text)
    message = str(caught.value)
    assert message.startswith("--motion ")
    assert problem in message
    assert "\n" not in message
