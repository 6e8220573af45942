"""Hold every setting of a run, as a TOML file has them and flags override them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from tiegocancel.files.options import ReadOptions
from tiegocancel.filters.config import FilterConfig
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.mcu.config import McuConfig
from tiegocancel.matching.config import CancelConfig
from tiegocancel.scene.camera_config import CameraSceneConfig
from tiegocancel.scene.config import SceneConfig
from tiegocancel.study.budget.settings import BudgetSettings
from tiegocancel.study.guard import GuardConfig

__all__ = [
    "EstimateSettings",
    "MotionSettings",
    "OutputSettings",
    "ReadSettings",
    "ReportSettings",
    "Settings",
    "SimulateSettings",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadSettings(ReadOptions):
    """Add the ``format`` to what may be declared of a recording; ``None`` lets its header tell."""

    format: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionSettings:
    """Say where the motion comes from and how it reaches the canceller.

    ``source``: ``fit`` (one rotation for the recording), ``track`` (estimated on the way, from past events alone),
    ``gyro``, ``CX,CY,OMEGA`` (px, px, rad/s), a CSV file or a schedule file; ``refine`` corrects it by what the
    residuals of a sample show; ``interpolation`` of a CSV file's rows, ``file`` being what the file itself says;
    ``path``: ``integer`` (fixed-point schedule, one entry every ``schedule_step_us``) or ``float`` (interpolated at
    each event's own time). ``hold_us`` makes a motion that is found on the way fail open: so long after the last
    confident row it counts as unknown, and nothing is suppressed; a motion at rest suppresses nothing. 0 never does.
    """

    source: str = "fit"
    refine: bool = False
    interpolation: Literal["file", "linear", "spline", "causal"] = "file"
    path: Literal["integer", "float"] = "integer"
    schedule_step_us: int = 1000
    hold_us: int = 30_000

    def __post_init__(self) -> None:
        if self.hold_us < 0:
            raise ValueError(f"hold_us must not be negative, not {self.hold_us}")
        if self.schedule_step_us < 1:
            raise ValueError(f"schedule_step_us must be at least 1 µs, not {self.schedule_step_us}")


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimateSettings:
    """Say how the motion is estimated from past events, from a gyroscope, or from both.

    ``method``: ``contrast`` (images of warped events), ``circle`` (the thesis's circle fit) or ``gyro`` alone. A row
    every ``step_us`` from the last ``window_us``, of about ``max_events`` events drawn with ``seed``; 0 leaves a number
    to the method. ``gyro`` names the file of a gyroscope (AEDAT4, CSV), ``gyro_axes`` how its axes lie in the camera
    (``x,y,z`` is right, down, forward), ``gyro_offset_us`` what is added to its times, ``gyro_bias`` whether a bias is
    estimated whenever it rests or is taken as none. ``fusion`` of gyroscope and events: a Kalman filter that knows the
    bias, or exponential averaging with weight ``alpha`` (eq. 3.7). ``calibration`` names the camera's intrinsics: with
    it a gyroscope alone gives the turn about all three axes.
    """

    method: Literal["contrast", "circle", "gyro"] = "contrast"
    step_us: int = 0
    window_us: int = 0
    max_events: int = 0
    max_omega_rad_s: float = 200.0
    seed: int = 0
    gyro: str | None = None
    gyro_axes: str | None = None
    gyro_offset_us: int = 0
    gyro_bias: Literal["rest", "none"] = "rest"
    fusion: Literal["kalman", "exponential"] = "kalman"
    alpha: float = 0.2
    calibration: str | None = None

    def __post_init__(self) -> None:
        for name in ("step_us", "window_us", "max_events", "seed"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must not be negative, not {getattr(self, name)}")
        if not 0.0 < self.alpha <= 1.0:
            raise ValueError(f"alpha must lie in (0, 1], not {self.alpha}")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportSettings:
    """Say what is measured beside the main run.

    ``disc_radius_px``: region that turns, ``None`` guesses it from where the density of events drops;
    ``controls``: run zero motion, reversed motion and shuffled times too; ``diagnose``: tell a wrong centre
    from a wrong ω by the residuals of a rotation; ``shuffle_seed`` of the last;
    ``chunk_events`` a chunk of processing, which changes no number.
    """

    disc_radius_px: float | None = None
    controls: bool = True
    diagnose: bool = True
    shuffle_seed: int = 0
    chunk_events: int = 1 << 19

    def __post_init__(self) -> None:
        if self.disc_radius_px is not None and not 0 <= self.disc_radius_px < float("inf"):
            raise ValueError(f"disc_radius_px must be a finite number of at least 0 px, not {self.disc_radius_px!r}")
        if not 0 <= self.shuffle_seed < 1 << 64:
            raise ValueError(f"shuffle_seed must be from 0 to 2^64 − 1, not {self.shuffle_seed}")
        if not 1 <= self.chunk_events <= 1 << 24:
            raise ValueError(f"chunk_events must be from 1 to {1 << 24}, not {self.chunk_events}")


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputSettings:
    """Say what is written: ``residual`` names the format of the residual events, ``none`` writes none."""

    residual: str = "npz"
    figures: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulateSettings:
    """Say which built-in scene is simulated (``scene`` or ``camera_scene``), how long it is and which seed it has."""

    kind: Literal["disc", "camera"] = "disc"
    duration_s: float = 0.5
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.duration_s <= 3600:
            raise ValueError(f"duration_s must be from 0 to 3600 s, not {self.duration_s!r}")
        if not 0 <= self.seed < 1 << 64:
            raise ValueError(f"seed must be from 0 to 2^64 − 1, not {self.seed}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Every table of a configuration file, by name."""

    read: ReadSettings = field(default_factory=ReadSettings)
    filter: FilterConfig = field(default_factory=FilterConfig)
    motion: MotionSettings = field(default_factory=MotionSettings)
    estimate: EstimateSettings = field(default_factory=EstimateSettings)
    cancel: CancelConfig = field(default_factory=CancelConfig)
    guard: GuardConfig = field(default_factory=GuardConfig)
    report: ReportSettings = field(default_factory=ReportSettings)
    output: OutputSettings = field(default_factory=OutputSettings)
    simulate: SimulateSettings = field(default_factory=SimulateSettings)
    scene: SceneConfig = field(default_factory=SceneConfig)
    camera_scene: CameraSceneConfig = field(default_factory=CameraSceneConfig)
    core: CoreConfig = field(default_factory=CoreConfig)
    mcu: McuConfig = field(default_factory=McuConfig)
    budget: BudgetSettings = field(default_factory=BudgetSettings)
