"""The built-in scenes: a turning patterned disc that a hand crosses, a far world before a camera, and kin."""

from tiegocancel.scene.camera import simulate, simulate_camera
from tiegocancel.scene.camera_config import CameraSceneConfig
from tiegocancel.scene.camera_motion import CameraMotionConfig
from tiegocancel.scene.companion import CompanionConfig
from tiegocancel.scene.config import SceneConfig
from tiegocancel.scene.gyro import GyroConfig, gyro_samples
from tiegocancel.scene.library import SCENES, Preset, scene_named
from tiegocancel.scene.mover import MoverConfig
from tiegocancel.scene.photograph import photograph
from tiegocancel.scene.rig import RigConfig
from tiegocancel.scene.sensor import SensorConfig
from tiegocancel.scene.sidecars import write_sidecars
from tiegocancel.scene.truth import camera_truth, ground_truth, true_motion
from tiegocancel.scene.wall import WallConfig

__all__ = [
    "SCENES",
    "CameraMotionConfig",
    "CameraSceneConfig",
    "CompanionConfig",
    "GyroConfig",
    "MoverConfig",
    "Preset",
    "RigConfig",
    "SceneConfig",
    "SensorConfig",
    "WallConfig",
    "camera_truth",
    "ground_truth",
    "gyro_samples",
    "photograph",
    "scene_named",
    "simulate",
    "simulate_camera",
    "true_motion",
    "write_sidecars",
]
