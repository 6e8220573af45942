"""Cancel the ego-motion events of an event camera: predict, wait, match, in constant memory.

Names are loaded on first use, so that importing the package costs nothing and prints nothing.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tiegocancel.errors import ConfigError, InputError, MissingExtraError, TiegoCancelError
    from tiegocancel.events import EVENT_DTYPE, Events
    from tiegocancel.files import open_events, open_writer, read_events, write_events
    from tiegocancel.matching.canceller import Canceller, Decisions
    from tiegocancel.matching.config import CancelConfig
    from tiegocancel.motion.affine import AffineTrajectory
    from tiegocancel.motion.camera import CameraTrajectory
    from tiegocancel.motion.intrinsics import CameraIntrinsics
    from tiegocancel.motion.rotation import RotationTrajectory
    from tiegocancel.motion.schedule import MotionSchedule

__version__ = "0.1.0"

# In a source tree the two other rooms lie beside this folder, and an interpreter started there finds this folder
# before the installed package: let it find the rooms too.
_tree = Path(__file__).resolve().parent.parent
if (_tree / "pyproject.toml").exists() and (_tree / "kernels" / "runtime.py").exists():
    __path__.append(str(_tree))

_HOME = {
    "AffineTrajectory": "tiegocancel.motion.affine",
    "CameraIntrinsics": "tiegocancel.motion.intrinsics",
    "CameraTrajectory": "tiegocancel.motion.camera",
    "CancelConfig": "tiegocancel.matching.config",
    "Canceller": "tiegocancel.matching.canceller",
    "ConfigError": "tiegocancel.errors",
    "Decisions": "tiegocancel.matching.canceller",
    "EVENT_DTYPE": "tiegocancel.events",
    "Events": "tiegocancel.events",
    "InputError": "tiegocancel.errors",
    "MissingExtraError": "tiegocancel.errors",
    "MotionSchedule": "tiegocancel.motion.schedule",
    "RotationTrajectory": "tiegocancel.motion.rotation",
    "TiegoCancelError": "tiegocancel.errors",
    "open_events": "tiegocancel.files",
    "open_writer": "tiegocancel.files",
    "read_events": "tiegocancel.files",
    "write_events": "tiegocancel.files",
}

__all__ = [
    "EVENT_DTYPE",
    "AffineTrajectory",
    "CameraIntrinsics",
    "CameraTrajectory",
    "CancelConfig",
    "Canceller",
    "ConfigError",
    "Decisions",
    "Events",
    "InputError",
    "MissingExtraError",
    "MotionSchedule",
    "RotationTrajectory",
    "TiegoCancelError",
    "__version__",
    "open_events",
    "open_writer",
    "read_events",
    "write_events",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'tiegocancel' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
