"""Show a scene as an ordinary camera would see it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.camera_config import CameraSceneConfig
from tiegocancel.scene.config import SceneConfig

__all__ = ["photograph"]


def photograph(config: SceneConfig | CameraSceneConfig, *, time_s: float = 0.0) -> NDArray[np.float32]:
    """Return the intensity float32[height, width] at one instant, as a share of the light."""
    from tiegocancel.scene.stage import Stage
    from tiegocancel.scene.world_stage import WorldStage

    stage = Stage(config) if isinstance(config, SceneConfig) else WorldStage(config)
    everywhere = np.arange(config.width * config.height, dtype=np.int32)
    levels = stage.look(everywhere, np.array([time_s])).levels
    return np.exp(levels[:, 0]).reshape(config.height, config.width)
