"""Read a camera's calibration from the files that calibration tools leave behind."""

from __future__ import annotations

import tomllib
from math import isfinite
from pathlib import Path
from typing import Any

from tiegocancel.config import fill
from tiegocancel.errors import ConfigError, InputError, MissingExtraError
from tiegocancel.files.short import short
from tiegocancel.motion.intrinsics import CameraIntrinsics

__all__ = ["read_calibration"]

_MAX_BYTES = 1 << 20
_LINE = "fx fy cx cy k1 k2 p1 p2 k3"
_ROS_MODELS = {"plumb_bob": "radtan", "rational_polynomial": "radtan", "equidistant": "equidistant", "": "radtan"}
_KALIBR_MODELS = {"radtan": "radtan", "equidistant": "equidistant", "none": "radtan"}


def read_calibration(path: str | Path) -> CameraIntrinsics:
    """Read a calibration; the suffix tells which.

    - ``.toml``: the fields of :class:`CameraIntrinsics` by name, for example ``distortion = [-0.37, 0.2]``.
    - ``.yaml``, ``.yml``: Kalibr's camchain (its ``cam0``; pinhole with radtan, equidistant or none) or ROS camera_info
      (``camera_matrix`` with ``distortion_model`` plumb_bob or equidistant, or a message's ``K`` and ``D``). Needs the
      ``calibration`` extra.
    - anything else: one line of numbers, ``fx fy cx cy`` and then ``k1 k2 p1 p2 k3`` or none, as the ``calib.txt`` of
      the Event-Camera Dataset (Mueggler et al., IJRR 2017) has them.

    Raise ``InputError`` naming file and field for anything else, ``MissingExtraError`` without the extra.
    """
    text = _text(path)
    suffix = Path(path).suffix.lower()
    if suffix == ".toml":
        return _of_toml(path, text)
    if suffix in (".yaml", ".yml"):
        return _of_yaml(path, text)
    return _of_line(path, text)


def _of_toml(path: str | Path, text: str) -> CameraIntrinsics:
    """Read the fields by name."""
    try:
        return fill(CameraIntrinsics, tomllib.loads(text), "calibration")
    except ConfigError as error:
        raise InputError(path, "", " ".join(str(error).split())) from None
    except (ValueError, RecursionError, OverflowError) as error:
        raise InputError(path, "", f"is not valid TOML: {short(error)}") from None


def _of_line(path: str | Path, text: str) -> CameraIntrinsics:
    """Read numbers between blanks or commas, from however many lines."""
    cells = text.replace(",", " ").split()
    if len(cells) not in (4, 8, 9):
        raise InputError(path, "", f"holds {len(cells)} words, expected the 9 numbers {_LINE}")
    names = _LINE.split()
    values = [_number(path, name, cell) for name, cell in zip(names, cells, strict=False)]
    return _checked(path, values[:4], "radtan", values[4:], None)


def _of_yaml(path: str | Path, text: str) -> CameraIntrinsics:
    """Read Kalibr's or ROS's form."""
    try:
        import yaml
    except ImportError:
        raise MissingExtraError(f"reading the calibration {path}", "pyyaml", "calibration") from None
    try:
        document = yaml.safe_load(text)
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        mark = getattr(error, "problem_mark", None)
        where = "" if mark is None else f"line {mark.line + 1}"
        reason = getattr(error, "problem", None) or error
        raise InputError(path, where, f"is not valid YAML: {short(reason)}") from None
    if not isinstance(document, dict):
        raise InputError(path, "", "holds no table, expected Kalibr's cam0 or ROS's camera_matrix")
    camera = document.get("cam0", document)
    if isinstance(camera, dict) and "intrinsics" in camera:
        return _of_kalibr(path, camera)
    return _of_ros(path, document)


def _of_kalibr(path: str | Path, camera: dict[Any, Any]) -> CameraIntrinsics:
    """Read one camera of a camchain."""
    projection = camera.get("camera_model", "pinhole")
    if projection != "pinhole":
        raise InputError(path, "camera_model", f"is {_shown(projection)}, expected pinhole")
    model = _model(path, camera.get("distortion_model", "none"), _KALIBR_MODELS)
    coefficients = _numbers(path, "distortion_coeffs", camera.get("distortion_coeffs", []), (0, 4, 5))
    if camera.get("distortion_model") == "none":
        coefficients = []
    size = camera.get("resolution")
    sides = None if size is None else _numbers(path, "resolution", size, (2,))
    return _checked(path, _numbers(path, "intrinsics", camera["intrinsics"], (4,)), model, coefficients, sides)


def _of_ros(path: str | Path, info: dict[Any, Any]) -> CameraIntrinsics:
    """Read a camera_info file, or the fields of the message."""
    name = next((key for key in ("camera_matrix", "K", "k") if key in info), None)
    if name is None:
        raise InputError(path, "", "has no cam0 with intrinsics, camera_matrix or K")
    matrix = _numbers(path, name, _data(info[name]), (9,))
    if any(matrix[place] for place in (1, 3, 6, 7)) or matrix[8] != 1.0:
        raise InputError(path, name, "has skew or is not of the form [fx 0 cx 0 fy cy 0 0 1]")
    bent = next((key for key in ("distortion_coefficients", "D", "d") if key in info), None)
    coefficients = [] if bent is None else _numbers(path, bent, _data(info[bent]), (0, 4, 5, 8, 12, 14))
    if any(coefficients[5:]):
        raise InputError(path, str(bent), f"has {len(coefficients)} coefficients, expected the five of plumb_bob")
    model = _model(path, info.get("distortion_model", ""), _ROS_MODELS)
    sides = [info.get(f"image_{side}", info.get(side)) for side in ("width", "height")]
    known = None if None in sides else _numbers(path, "image_width, image_height", sides, (2,))
    return _checked(path, [matrix[place] for place in (0, 4, 2, 5)], model, coefficients[:5], known)


def _checked(
    path: str | Path, focus: list[float], model: str, coefficients: list[float], size: list[float] | None
) -> CameraIntrinsics:
    """Build the calibration; its own checks name the field."""
    width, height = (None, None) if size is None else (int(size[0]), int(size[1]))
    fx, fy, cx, cy = focus
    table = {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "model": model, "distortion": coefficients}
    if width is not None:
        table.update(width=width, height=height)
    try:
        return fill(CameraIntrinsics, table, "calibration")
    except ConfigError as error:
        raise InputError(path, "", str(error)) from None


def _model(path: str | Path, name: object, known: dict[str, str]) -> str:
    """Translate the name of a distortion model."""
    if not isinstance(name, str) or name not in known:
        raise InputError(
            path, "distortion_model", f"is {_shown(name)}, expected one of {', '.join(filter(None, known))}"
        )
    return known[name]


def _data(value: object) -> object:
    """Return the numbers of a matrix, written with its shape or without."""
    return value.get("data") if isinstance(value, dict) else value


def _numbers(path: str | Path, name: str, values: object, counts: tuple[int, ...]) -> list[float]:
    """Check a list of numbers."""
    if not isinstance(values, list) or len(values) not in counts:
        found = f"{len(values)} numbers" if isinstance(values, list) else _shown(values)
        raise InputError(path, name, f"expected {' or '.join(map(str, counts))} numbers, found {found}")
    return [_number(path, name, value) for value in values]


def _number(path: str | Path, name: str, value: object) -> float:
    """Check one number; YAML gives ``1e-3`` as text."""
    try:
        number = float(value) if isinstance(value, int | float | str) and not isinstance(value, bool) else None
    except (ValueError, OverflowError):
        number = None
    if number is None or not isfinite(number):
        raise InputError(path, name, f"expected a finite number, found {_shown(value)}")
    return number


def _shown(value: object) -> str:
    """Print a value for a message; a container by its kind alone, for it may hold itself many times over."""
    return short(repr(value)) if value is None or isinstance(value, str | bool | int | float) else type(value).__name__


def _text(path: str | Path) -> str:
    """Read a small text file."""
    try:
        with Path(path).open("rb") as file:
            raw = file.read(_MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(path, "", f"cannot be read: {reason}") from None
    if len(raw) > _MAX_BYTES:
        raise InputError(path, "", f"is larger than {_MAX_BYTES} bytes, expected a calibration file")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(path, f"byte {error.start}", "is not UTF-8 text; expected a calibration file") from None
