"""Hold every setting of a run, as a TOML file has them and flags override them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from tiegocancel.files.options import ReadOptions
from tiegocancel.matching.config import CancelConfig
from tiegocancel.scene.config import SceneConfig

__all__ = ["MotionSettings", "OutputSettings", "ReadSettings", "ReportSettings", "Settings", "SimulateSettings"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadSettings(ReadOptions):
    """Add the ``format`` to what may be declared of a recording; ``None`` lets its header tell."""

    format: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionSettings:
    """Say where the motion comes from and how it reaches the canceller.

    ``source``: ``fit``, ``CX,CY,OMEGA`` (px, px, rad/s) or a CSV file; ``path``: ``integer`` (fixed-point schedule, one
    entry every ``schedule_step_us``) or ``float`` (interpolated at each event's own time).
    """

    source: str = "fit"
    path: Literal["integer", "float"] = "integer"
    schedule_step_us: int = 1000

    def __post_init__(self) -> None:
        if self.schedule_step_us < 1:
            raise ValueError(f"schedule_step_us must be at least 1 µs, not {self.schedule_step_us}")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportSettings:
    """Say what is measured beside the main run.

    ``disc_radius_px``: region that turns, ``None`` guesses it from where the density of events drops;
    ``controls``: run zero motion, reversed motion and shuffled times too; ``shuffle_seed`` of the last;
    ``chunk_events`` a chunk of processing, which changes no number.
    """

    disc_radius_px: float | None = None
    controls: bool = True
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
    """Say how long the built-in scene is and which seed it has."""

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
    motion: MotionSettings = field(default_factory=MotionSettings)
    cancel: CancelConfig = field(default_factory=CancelConfig)
    report: ReportSettings = field(default_factory=ReportSettings)
    output: OutputSettings = field(default_factory=OutputSettings)
    simulate: SimulateSettings = field(default_factory=SimulateSettings)
    scene: SceneConfig = field(default_factory=SceneConfig)
