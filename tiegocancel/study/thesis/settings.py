"""Hold what the thesis's experiments vary: its own grids unless a file says otherwise."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

__all__ = [
    "AgreementSettings",
    "BiasSettings",
    "CompensationSettings",
    "EngineSettings",
    "GateSettings",
    "GridSettings",
    "PointSettings",
    "ThesisSettings",
    "VideoSettings",
    "WindowSettings",
]


_QUICK_US = (0, 1000, 2000, 4000, 6000, 8000)


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowSettings:
    """Choose the windows W1 … Wn (§6.2.4): ``length_us`` each, at ``starts_s`` or, without any, as the thesis has them.

    The thesis's lie in pairs at 0.50, 0.82 and 0.90 of a recording of 10 s; here at these shares of any recording.
    """

    length_us: int = 10_000
    count: int = 6
    starts_s: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not 100 <= self.length_us <= 10_000_000:
            raise ValueError(f"length_us must be from 100 µs to 10 s, not {self.length_us}")
        if not 1 <= self.count <= 100:
            raise ValueError(f"count must be from 1 to 100 windows, not {self.count}")


@dataclass(frozen=True, slots=True, kw_only=True)
class PointSettings:
    """The operating point of the single figures, and the long horizon beside it at which matches mean something."""

    horizon_us: int = 2000
    long_horizon_us: int = 8000
    tolerance_us: int = 1000
    tolerance_px: float = 2.0

    def __post_init__(self) -> None:
        _positive(self, "horizon_us", "long_horizon_us", "tolerance_us", "tolerance_px")


@dataclass(frozen=True, slots=True, kw_only=True)
class GridSettings:
    """The sweep of §6.3.3: 21 × 5 × 5 = 525 combinations; ``heatmaps_us`` are the horizons that are drawn.

    ``windows`` of them all take part.
    """

    horizons_us: tuple[int, ...] = tuple(range(0, 20_001, 1000))
    tolerances_px: tuple[float, ...] = (1.0, 1.5, 2.0, 3.0, 5.0)
    tolerances_us: tuple[int, ...] = (500, 1000, 1500, 2000, 2500)
    heatmaps_us: tuple[int, ...] = (2000, 4000, 6000)
    windows: int = 1

    def __post_init__(self) -> None:
        for name in ("horizons_us", "tolerances_px", "tolerances_us"):
            if not getattr(self, name) or min(getattr(self, name)) < 0:
                raise ValueError(f"{name} must be numbers of at least 0, not {list(getattr(self, name))}")


@dataclass(frozen=True, slots=True, kw_only=True)
class BiasSettings:
    """Errors put on the motion (Fig. 7.7, §8.5), in rad/s and px, at each of ``horizons_us``."""

    omega_rad_s: tuple[float, ...] = (0.0, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 12.5, 25.0, 50.0)
    center_px: tuple[float, ...] = (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0)
    horizons_us: tuple[int, ...] = (2000, 8000, 20_000)

    def __post_init__(self) -> None:
        if any(value < 0 for value in (*self.omega_rad_s, *self.center_px)):
            raise ValueError("omega_rad_s and center_px are sizes of errors and must not be negative")


@dataclass(frozen=True, slots=True, kw_only=True)
class GateSettings:
    """Temporal gates tried for ``ε_t ≈ ε_xy/(r|ω|)`` (§8.3)."""

    tolerances_us: tuple[int, ...] = (50, 100, 200, 300, 500, 700, 1000, 1500, 2000, 3000, 4000)


@dataclass(frozen=True, slots=True, kw_only=True)
class AgreementSettings:
    """Compare the streaming canceller with the reference over gates and densities of events."""

    tolerances_px: tuple[float, ...] = (1.0, 2.0, 3.0, 5.0)
    tolerances_us: tuple[int, ...] = (500, 1000, 2000)
    kept_shares: tuple[float, ...] = (1.0, 0.5, 0.25, 0.1)

    def __post_init__(self) -> None:
        if any(not 0.0 < share <= 1.0 for share in self.kept_shares):
            raise ValueError(f"kept_shares must lie in (0, 1], not {list(self.kept_shares)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class CompensationSettings:
    """Compare with motion compensation (research question 3); ``windows`` of them are looked at."""

    enabled: bool = True
    windows: int = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoSettings:
    """The high-pass video (§6.3.1): ``frame_us`` of events a frame, ``frames`` at most, ``fps`` shown a second."""

    enabled: bool = True
    frame_us: int = 5000
    frames: int = 40
    fps: int = 10

    def __post_init__(self) -> None:
        _positive(self, "frame_us", "frames", "fps")


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineSettings:
    """Say where jobs run, ``batch`` at a time.

    ``inline``; in ``workers`` ``processes`` (0: one a core); on the ``cluster`` whose scheduler is at ``address``.
    """

    kind: Literal["inline", "processes", "cluster"] = "processes"
    workers: int = 0
    address: str | None = None
    batch: int = 24

    def __post_init__(self) -> None:
        if not 0 <= self.workers <= 1024:
            raise ValueError(f"workers must be from 0 to 1024, not {self.workers}")
        if not 1 <= self.batch <= 10_000:
            raise ValueError(f"batch must be from 1 to 10000, not {self.batch}")
        if (self.kind == "cluster") != (self.address is not None):
            raise ValueError("a cluster, and it alone, has an address")


@dataclass(frozen=True, slots=True, kw_only=True)
class ThesisSettings:
    """Every table below ``[thesis]``."""

    windows: WindowSettings = field(default_factory=WindowSettings)
    point: PointSettings = field(default_factory=PointSettings)
    grid: GridSettings = field(default_factory=GridSettings)
    bias: BiasSettings = field(default_factory=BiasSettings)
    gates: GateSettings = field(default_factory=GateSettings)
    agreement: AgreementSettings = field(default_factory=AgreementSettings)
    compensation: CompensationSettings = field(default_factory=CompensationSettings)
    video: VideoSettings = field(default_factory=VideoSettings)
    engine: EngineSettings = field(default_factory=EngineSettings)

    def quick(self) -> ThesisSettings:
        """Return the same with few windows and coarse grids: a look, not a study."""
        keep = {*_QUICK_US, self.grid.horizons_us[-1]}
        return replace(
            self,
            windows=replace(self.windows, count=min(self.windows.count, 2)),
            grid=replace(
                self.grid,
                horizons_us=tuple(h for h in self.grid.horizons_us if h in keep),
                tolerances_px=self.grid.tolerances_px[::2],
                tolerances_us=tuple(dict.fromkeys((*self.grid.tolerances_us[1:2], self.grid.tolerances_us[-1]))),
            ),
            bias=replace(
                self.bias,
                omega_rad_s=tuple(dict.fromkeys((*self.bias.omega_rad_s[:2], *self.bias.omega_rad_s[4::2]))),
                center_px=self.bias.center_px[::3],
                horizons_us=self.bias.horizons_us[:2],
            ),
            gates=replace(self.gates, tolerances_us=self.gates.tolerances_us[::2]),
            agreement=replace(
                self.agreement,
                tolerances_px=self.agreement.tolerances_px[1::2],
                tolerances_us=self.agreement.tolerances_us[1:2],
                kept_shares=self.agreement.kept_shares[::2],
            ),
            compensation=replace(self.compensation, windows=1),
            video=replace(self.video, frames=min(self.video.frames, 6)),
        )

    @property
    def longest_us(self) -> int:
        """Longest horizon and gate of all: how far before a window events are wanted."""
        horizons = (*self.grid.horizons_us, *self.bias.horizons_us, self.point.horizon_us, self.point.long_horizon_us)
        gates = (*self.grid.tolerances_us, *self.gates.tolerances_us, *self.agreement.tolerances_us)
        return max(horizons) + max(*gates, self.point.tolerance_us)


def _positive(settings: object, *names: str) -> None:
    for name in names:
        if not getattr(settings, name) > 0:
            raise ValueError(f"{name} must be greater than 0, not {getattr(settings, name)}")
