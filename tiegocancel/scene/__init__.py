"""The built-in scene: a simulated event camera looking at a turning patterned disc that a hand crosses."""

from tiegocancel.scene.camera import simulate
from tiegocancel.scene.config import SceneConfig
from tiegocancel.scene.mover import MoverConfig
from tiegocancel.scene.photograph import photograph
from tiegocancel.scene.rig import RigConfig
from tiegocancel.scene.sensor import SensorConfig
from tiegocancel.scene.truth import ground_truth

__all__ = ["MoverConfig", "RigConfig", "SceneConfig", "SensorConfig", "ground_truth", "photograph", "simulate"]
