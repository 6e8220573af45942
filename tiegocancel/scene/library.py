"""Name the built-in scenes: each a few settings on top of the disc's or the camera's defaults."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from tiegocancel.config import fill
from tiegocancel.errors import ConfigError
from tiegocancel.scene.camera_config import CameraSceneConfig
from tiegocancel.scene.config import SceneConfig

__all__ = ["SCENES", "Preset", "preset_named", "scene_named"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Preset:
    """A scene of the library: what moves, what it is for, and the settings that make it."""

    kind: Literal["disc", "camera"]
    about: str
    table: Mapping[str, Any] = field(default_factory=dict)

    @property
    def table_name(self) -> str:
        """The table of a configuration file that holds this kind of scene."""
        return "scene" if self.kind == "disc" else "camera_scene"

    def under(self, table: Mapping[str, Any]) -> dict[str, Any]:
        """Return the preset's settings with those of ``table`` on top."""
        return _merged(self.table, table)


SCENES: Mapping[str, Preset] = {
    "disc": Preset(kind="disc", about="the thesis's rig: six pages on a disc at 3.6 rad/s, and a hand that crosses it"),
    "fine": Preset(
        kind="disc",
        about="print twice as fine: many edges a horizon, so that chance matches abound",
        table={"rig": {"line_period_px": 10.0, "shape_pitch_px": 13.0}},
    ),
    "coarse": Preset(
        kind="disc",
        about="print three times as coarse: few edges, wide apart",
        table={"rig": {"line_period_px": 64.0, "shape_pitch_px": 84.0}},
    ),
    "markers": Preset(
        kind="disc",
        about="bare wood with six round markers and a hub: hardly anything to see",
        table={"rig": {"pages": False}},
    ),
    "noisy": Preset(
        kind="disc",
        about="pale ink, just above threshold, under heavy noise and hot pixels",
        table={
            "rig": {"ink_reflectance": 0.64},
            "mover": {"reflectance": 0.60},
            "sensor": {"noise_hz": 1.0, "mismatch": 0.06, "jitter_us": 60.0, "hot_pixels": 200},
        },
    ),
    "ramp": Preset(
        kind="disc",
        about="a disc that gathers speed, 1 rad/s at the start and 10 rad/s² more and more",
        table={"rig": {"omega_rad_s": 1.0, "ramp_rad_s2": 10.0}},
    ),
    "stop-and-go": Preset(
        kind="disc",
        about="a disc that halts five times a second, smoothly, for 60 ms each time",
        table={"rig": {"stop_go_hz": 5.0, "stop_share": 0.3}},
    ),
    "camera": Preset(kind="camera", about="a hand-held camera that rolls and pans before a far world, and a hand"),
    "pan": Preset(
        kind="camera",
        about="a camera that pans evenly at 0.5 rad/s, and a hand that crosses against the flow",
        table={"motion": {"pan_rad_s": 0.0, "tilt_rad_s": 0.0, "roll_rad_s": 0.0, "pan_drift_rad_s": 0.5}},
    ),
    "two-movers": Preset(
        kind="disc",
        about="the disc with its hand, and a second hand that rides on it, nearly as fast as the print below",
        table={"companion": {"enabled": True}},
    ),
}


def preset_named(name: object, where: str = "scene") -> Preset:
    """Return the scene of that name; raise :class:`ConfigError`, naming the nearest one, where there is none."""
    if isinstance(name, str) and name in SCENES:
        return SCENES[name]
    near = difflib.get_close_matches(str(name), SCENES, n=1, cutoff=0.6)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise ConfigError(f"{where} must be one of {', '.join(map(repr, SCENES))}, not {name!r}{hint}")


def scene_named(name: str, table: Mapping[str, Any] | None = None) -> SceneConfig | CameraSceneConfig:
    """Return a scene of the library with the settings of ``table``, as a TOML file has them, on top.

    Raise :class:`ConfigError` for a name that is unknown and settings that are refused.
    """
    preset = preset_named(name)
    settings = preset.under(table or {})
    if preset.kind == "disc":
        return fill(SceneConfig, settings, f"scene {name}")
    return fill(CameraSceneConfig, settings, f"scene {name}")


def _merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Lay one table over another, tables within them alike."""
    merged = dict(below)
    for key, value in above.items():
        held = merged.get(key)
        merged[key] = _merged(held, value) if isinstance(held, Mapping) and isinstance(value, Mapping) else value
    return merged
