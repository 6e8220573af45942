"""Check that estimates survive in a file row by row and come back as the same trajectory."""

from __future__ import annotations

import csv
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import RotationTrajectory
from tiegocancel.errors import InputError
from tiegocancel.estimation.estimate import MotionEstimate, trajectory_of
from tiegocancel.estimation.estimates_csv import COLUMNS, EstimateWriter

NUMBER = st.floats(-1e6, 1e6, allow_subnormal=False)


@st.composite
def rows(draw):
    """Draw estimates with strictly increasing times, closely and widely spaced."""
    times = sorted(draw(st.sets(st.integers(-(10**9), 10**12) | st.integers(0, 50), min_size=1, max_size=12)))
    center = st.tuples(NUMBER, NUMBER) | st.just((math.nan, math.nan))
    return [
        MotionEstimate(
            t_us=time,
            center_px=draw(center),
            omega_rad_s=draw(NUMBER),
            omega_dot_rad_s2=draw(NUMBER),
            confident=draw(st.booleans()),
            doubt=draw(st.sampled_from(["", "few events, held", 'says "no"', "two\nlines"])),
        )
        for time in times
    ]


@given(estimates=rows())
def test_the_file_reads_back_as_the_trajectory_of_the_estimates(tmp_path_factory, estimates):
    target = tmp_path_factory.mktemp("estimates") / "e.csv"
    with EstimateWriter(target) as writer:
        writer.write(*estimates)
    if not any(estimate.has_center for estimate in estimates):
        with pytest.raises(InputError, match="knows a centre in none"):
            RotationTrajectory.from_csv(target)
        return
    expected, found = trajectory_of(estimates, source="e.csv"), RotationTrajectory.from_csv(target)
    for name in ("t_us", "center_px", "omega_rad_s", "omega_dot_rad_s2"):
        assert np.array_equal(getattr(found, name), getattr(expected, name))
    assert (found.interpolation, found.source) == ("causal", "e.csv")
    skipped = sum(not estimate.has_center for estimate in estimates)
    assert any(f"{skipped} of {len(estimates)} rows have no centre" in note for note in found.notes) == bool(skipped)
    doubtful = sum(estimate.has_center and not estimate.confident for estimate in estimates)
    assert any(f"{doubtful} of " in note and "doubtful" in note for note in found.notes) == bool(doubtful)


def test_columns_and_cells_are_the_documented_ones(tmp_path):
    with EstimateWriter(tmp_path / "e.csv") as writer:
        writer.write(
            MotionEstimate(t_us=1_500_000, center_px=(1.5, 2.0), omega_rad_s=3.25, sharpness=1.2, events_used=7)
        )
        writer.write(
            MotionEstimate(
                t_us=1_500_001, center_px=(math.nan,) * 2, omega_rad_s=0.0, confident=False, doubt="no, \n turn"
            )
        )
    with (tmp_path / "e.csv").open(newline="") as file:
        header, first, second = csv.reader(file)
    assert tuple(header) == COLUMNS
    assert first == ["1.500000", "1.5", "2.0", "3.25", "0.0", "inf", "inf", "1.2", "1", "7", ""]
    assert second == ["1.500001", "", "", "0.0", "0.0", "inf", "inf", "", "0", "0", "no, turn"]
    assert writer.count == 2


def test_each_row_is_there_before_the_next_comes(tmp_path):
    writer = EstimateWriter(tmp_path / "e.csv")
    for index in range(3):
        assert len((tmp_path / "e.csv").read_text().splitlines()) == 1 + index
        writer.write(MotionEstimate(t_us=index, center_px=(1.0, 2.0), omega_rad_s=3.0))
    writer.close()
    writer.close()


def test_rows_survive_a_program_that_dies(tmp_path):
    program = (
        "import os, sys\n"
        "from tiegocancel.estimation.estimate import MotionEstimate\n"
        "from tiegocancel.estimation.estimates_csv import EstimateWriter\n"
        "writer = EstimateWriter(sys.argv[1])\n"
        "for t in range(5):\n"
        "    writer.write(MotionEstimate(t_us=t, center_px=(1.0, 2.0), omega_rad_s=t))\n"
        "os._exit(9)\n"
    )
    done = subprocess.run([sys.executable, "-c", program, os.fspath(tmp_path / "e.csv")], check=False)
    assert done.returncode == 9
    assert RotationTrajectory.from_csv(tmp_path / "e.csv").omega_rad_s.tolist() == [0, 1, 2, 3, 4]


def test_times_that_do_not_increase_are_refused(tmp_path):
    with EstimateWriter(tmp_path / "e.csv") as writer:
        writer.write(MotionEstimate(t_us=5, center_px=(1.0, 2.0), omega_rad_s=3.0))
        with pytest.raises(ValueError, match="5 µs after 5 µs"):
            writer.write(MotionEstimate(t_us=5, center_px=(1.0, 2.0), omega_rad_s=3.0))
    assert RotationTrajectory.from_csv(tmp_path / "e.csv").t_us.tolist() == [5]
