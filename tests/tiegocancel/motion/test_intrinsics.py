"""Check both lens models against their inverses, and every calibration file against the same camera."""

from __future__ import annotations

import contextlib
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel import CameraIntrinsics
from tiegocancel.errors import InputError, MissingExtraError

RADTAN = {
    "k1": st.floats(-0.5, 0.5),
    "k2": st.floats(-0.2, 0.3),
    "p1": st.floats(-5e-3, 5e-3),
    "p2": st.floats(-5e-3, 5e-3),
    "k3": st.floats(-0.05, 0.05),
}
FOCUS = {"fx": 200.5, "fy": 199.5, "cx": 130.25, "cy": 110.75}


def grid(width=240, height=180):
    y, x = np.mgrid[0:height:4, 0:width:4]
    return x.ravel().astype(float), y.ravel().astype(float)


@given(**RADTAN)
@settings(max_examples=50)
def test_radtan_undistorts_what_it_distorts_to_a_millionth_of_a_pixel(k1, k2, p1, p2, k3):
    lens = CameraIntrinsics(**FOCUS, distortion=(k1, k2, p1, p2, k3))
    x, y = grid()
    straight_x, straight_y = lens.undistort(x, y)
    again_x, again_y = lens.distort(straight_x, straight_y)
    seen = ~np.isnan(straight_x)
    assert np.array_equal(seen, ~np.isnan(straight_y))
    assert np.abs(again_x[seen] - x[seen]).max() <= 1e-6
    assert np.abs(again_y[seen] - y[seen]).max() <= 1e-6
    # Near the axis, every lens shows something.
    assert seen[np.hypot(x - 130, y - 110) < 60].all()


@given(k=st.lists(st.floats(-0.05, 0.05), min_size=4, max_size=4))
@settings(max_examples=30)
def test_fisheye_undistorts_what_it_distorts(k):
    lens = CameraIntrinsics(**FOCUS, model="equidistant", distortion=tuple(k))
    x, y = grid()
    straight_x, straight_y = lens.undistort(x, y)
    again_x, again_y = lens.distort(straight_x, straight_y)
    assert np.nanmax(np.hypot(again_x - x, again_y - y)) <= 1e-6
    assert not np.isnan(straight_x[np.hypot(x - 130, y - 110) < 80]).any()


def test_distortion_is_the_published_formula():
    k1, k2, p1, p2, k3 = coefficients = (-0.4, 0.2, 1e-3, -2e-3, 0.03)
    lens = CameraIntrinsics(**FOCUS, distortion=coefficients)
    x, y = 0.3, -0.2
    s = x * x + y * y
    radial = 1 + k1 * s + k2 * s**2 + k3 * s**3
    expected_x = x * radial + 2 * p1 * x * y + p2 * (s + 2 * x * x)
    expected_y = y * radial + p1 * (s + 2 * y * y) + 2 * p2 * x * y
    found = lens.pixels(x, y)
    assert found == pytest.approx((130.25 + 200.5 * expected_x, 110.75 + 199.5 * expected_y), abs=1e-9)


def test_ideal_fisheye_shows_the_angle_as_radius():
    lens = CameraIntrinsics(fx=100.0, fy=100.0, cx=0.0, cy=0.0, model="equidistant")
    assert lens.pixels([np.tan(0.7), 0.0], [0.0, np.tan(1.2)])[0] == pytest.approx([70.0, 0.0])
    x, y = lens.undistort([70.0, 0.0, 0.0], [0.0, 120.0, 0.0])
    assert (x.tolist(), y.tolist()) == (
        pytest.approx([100 * np.tan(0.7), 0, 0]),
        pytest.approx([0, 257.2152, 0], rel=1e-6),
    )


def test_beyond_the_field_there_is_no_place():
    # r·(1 − 0.9 r²) is largest at r = 0.6086, where it shows 0.4057.
    lens = CameraIntrinsics(fx=100.0, fy=100.0, cx=0.0, cy=0.0, distortion=(-0.9,))
    assert np.isnan(lens.undistort([40.5, 40.6, -80.0], [0.0, 0.0, 10.0])[0]).tolist() == [False, True, True]
    assert np.isnan(lens.distort([60.8, 60.9, np.nan], [0.0, 0.0, 0.0])[0]).tolist() == [False, True, True]
    around = CameraIntrinsics(fx=100.0, fy=100.0, cx=0.0, cy=0.0, model="equidistant")
    assert np.isnan(around.undistort([150.0, 158.0], [0.0, 0.0])[0]).tolist() == [False, True]


def test_pixels_do_not_depend_on_their_neighbours():
    lens = CameraIntrinsics(**FOCUS, distortion=(-0.37, 0.15, 1e-3, -1e-3, 0.01))
    x, y = grid()
    whole = np.stack(lens.undistort(x, y))
    parts = [np.stack(lens.undistort(x[a:b], y[a:b])) for a, b in ((0, 1), (1, 6), (6, 777), (777, len(x)))]
    assert np.concatenate(parts, axis=1).tobytes() == whole.tobytes()


def test_a_pinhole_moves_nothing():
    lens = CameraIntrinsics(**FOCUS)
    assert lens.is_pinhole
    x, y = grid()
    assert np.allclose(lens.undistort(x, y), (x, y), atol=1e-12)
    assert CameraIntrinsics(**FOCUS, distortion=(-0.3,)).pinhole() == lens
    assert not CameraIntrinsics(**FOCUS, model="equidistant").is_pinhole


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fx": 0.0}, "fx must be positive"),
        ({"fy": float("nan")}, "fy must be positive"),
        ({"cx": float("inf")}, "cx must be within"),
        ({"model": "fov"}, "model must be radtan or equidistant, not 'fov'"),
        ({"distortion": (0.0,) * 6}, "at most 5 numbers"),
        ({"distortion": (0.1, float("nan"))}, "distortion k2 must be finite"),
        ({"width": 0}, "width must be from 1"),
    ],
)
def test_broken_fields_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        CameraIntrinsics(**{**FOCUS, **change})


KALIBR = """cam0:
  camera_model: pinhole
  intrinsics: [200.5, 199.5, 130.25, 110.75]
  distortion_model: radtan
  distortion_coeffs: [-0.25, 0.0625, 1.0e-3, 1e-4]
  resolution: [240, 180]
cam1: {}
"""
ROS = """image_width: 240
image_height: 180
camera_name: dvs
camera_matrix:
  rows: 3
  cols: 3
  data: [200.5, 0, 130.25, 0, 199.5, 110.75, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.25, 0.0625, 0.001, 0.0001, 0]
"""
MESSAGE = """height: 180
width: 240
distortion_model: plumb_bob
D: [-0.25, 0.0625, 0.001, 0.0001, 0]
K: [200.5, 0, 130.25, 0, 199.5, 110.75, 0, 0, 1]
"""
TOML = """fx = 200.5
fy = 199.5
cx = 130.25
cy = 110.75
distortion = [-0.25, 0.0625, 1e-3, 1e-4]
width = 240
height = 180
"""


@pytest.mark.parametrize(
    ("name", "text", "sized"),
    [
        ("camera.toml", TOML, True),
        ("camchain.yaml", KALIBR, True),
        ("ost.yml", ROS, True),
        ("info.yaml", MESSAGE, True),
        ("calib.txt", "200.5 199.5 130.25 110.75 -0.25 0.0625 0.001 0.0001 0\n", False),
        ("calib.csv", "200.5,199.5,130.25,110.75,-0.25,0.0625,1e-3,1e-4", False),
    ],
)
def test_every_format_gives_the_same_camera(tmp_path, name, text, sized):
    if name.endswith(("yaml", "yml")):
        pytest.importorskip("yaml", reason="the calibration extra is not installed")
    (tmp_path / name).write_text(text)
    size = {"width": 240, "height": 180} if sized else {}
    expected = CameraIntrinsics(**FOCUS, distortion=(-0.25, 0.0625, 1e-3, 1e-4), **size)
    assert CameraIntrinsics.from_file(tmp_path / name) == expected


def test_kalibr_fisheye_and_no_distortion(tmp_path):
    pytest.importorskip("yaml", reason="the calibration extra is not installed")
    target = tmp_path / "c.yaml"
    target.write_text(KALIBR.replace("radtan", "equidistant"))
    assert CameraIntrinsics.from_file(target).model == "equidistant"
    target.write_text(KALIBR.replace("radtan", "none"))
    assert CameraIntrinsics.from_file(target).is_pinhole


@pytest.mark.parametrize(
    ("name", "text", "problem"),
    [
        ("a.txt", "", "holds 0 words, expected the 9 numbers fx fy cx cy"),
        ("a.txt", "1 2 3 4 5", "holds 5 words"),
        ("a.txt", "1 2 3 x", "cy: expected a finite number, found 'x'"),
        ("a.txt", "-1 2 3 4", "fx must be positive"),
        ("a.txt", b"\xff\xfe", "byte 0: is not UTF-8"),
        ("a.txt", " " * (1 << 21), "is larger than"),
        ("a.toml", "fx = 1.0", "missing"),
        ("a.toml", "fx =", "is not valid TOML"),
        ("a.toml", "fx = " + "9" * 5000, "is not valid TOML"),
        ("a.toml", "fx = " + "9" * 400, "is not valid TOML"),
        ("a.toml", TOML + "fz = 1.0", "unknown key 'fz'"),
        ("a.toml", TOML.replace("200.5", '"big"'), "fx must be float, not 'big'"),
        ("a.yaml", "cam0: [", "is not valid YAML"),
        ("a.yaml", "cam0: " + "[" * 5000, "is not valid YAML"),
        ("a.yaml", "- 1", "holds no table"),
        ("a.yaml", "x: 1", "has no cam0 with intrinsics, camera_matrix or K"),
        ("a.yaml", KALIBR.replace("pinhole", "omni"), "camera_model: is 'omni', expected pinhole"),
        ("a.yaml", KALIBR.replace("radtan", "fov"), "distortion_model: is 'fov'"),
        ("a.yaml", KALIBR.replace("199.5, ", ""), "intrinsics: expected 4 numbers, found 3 numbers"),
        ("a.yaml", KALIBR.replace("199.5", "[1]"), "intrinsics: expected a finite number, found list"),
        ("a.yaml", KALIBR.replace("[240", "[.inf"), "resolution: expected a finite number, found inf"),
        ("a.yaml", ROS.replace("[200.5, 0,", "[200.5, 3,"), "camera_matrix: has skew"),
        ("a.yaml", ROS.replace("0.0001, 0]", "0.0001, 0, 1, 0, 0]"), "has 8 coefficients"),
    ],
)
def test_faults_name_file_and_field_in_one_line(tmp_path, name, text, problem):
    if name.endswith("yaml"):
        pytest.importorskip("yaml", reason="the calibration extra is not installed")
    target = tmp_path / name
    target.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError) as caught:
        CameraIntrinsics.from_file(target)
    message = str(caught.value)
    assert message.startswith(str(target))
    assert problem in message
    assert "\n" not in message
    assert len(message) < 300 + len(str(target))


def test_values_that_hold_themselves_many_times_do_not_fill_the_memory(tmp_path):
    pytest.importorskip("yaml", reason="the calibration extra is not installed")
    lines = ["a0: &a0 [1, 1]"] + [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 30)]
    target = tmp_path / "laughs.yaml"
    target.write_text("\n".join([*lines, "cam0:", "  intrinsics: [*a29, *a29, *a29, *a29]"]))
    with pytest.raises(InputError, match="found list"):
        CameraIntrinsics.from_file(target)


def test_without_the_extra_the_line_names_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "yaml", None)
    (tmp_path / "c.yaml").write_text(KALIBR)
    with pytest.raises(MissingExtraError, match=r"tiegocancel\[calibration\]"):
        CameraIntrinsics.from_file(tmp_path / "c.yaml")


def test_absent_file_is_clear(tmp_path):
    with pytest.raises(InputError, match="cannot be read: No such file"):
        CameraIntrinsics.from_file(tmp_path / "none.toml")


@given(data=st.binary(max_size=200), suffix=st.sampled_from(["txt", "toml", "yaml"]))
def test_fuzzed_bytes_read_or_fail_cleanly(tmp_path_factory, data, suffix):
    if suffix == "yaml":
        pytest.importorskip("yaml", reason="the calibration extra is not installed")
    target = tmp_path_factory.mktemp("fuzz") / f"fuzz.{suffix}"
    target.write_bytes(data)
    with contextlib.suppress(InputError):
        CameraIntrinsics.from_file(target)
