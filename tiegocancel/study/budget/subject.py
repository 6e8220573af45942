"""Hold everything about a design that a change may touch, and judge it on a part."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tiegocancel.firmware_sim.arrival import InputPath
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.core.design import CoreDesign
from tiegocancel.firmware_sim.core.ladder import choose_core, fits, rungs
from tiegocancel.firmware_sim.mcu.config import McuConfig
from tiegocancel.firmware_sim.offer import Offer
from tiegocancel.firmware_sim.target import Target
from tiegocancel.firmware_sim.target_fpga import FpgaTarget
from tiegocancel.firmware_sim.target_memory import ExternalMemory
from tiegocancel.firmware_sim.verdict import Verdict
from tiegocancel.matching.config import CancelConfig
from tiegocancel.study.budget.ground import Ground
from tiegocancel.study.budget.settings import BudgetSettings

__all__ = ["Subject", "offer_of"]


@dataclass(frozen=True, slots=True)
class Subject:
    """A canceller built in some way on some ground: what is judged, and what changes change."""

    ground: Ground
    cancel: CancelConfig
    core: CoreConfig
    offer: Offer
    clock_hz: float
    fixed: bool
    narrow_stamps: bool = False
    external: ExternalMemory | None = None
    mcu: McuConfig | None = None

    def narrowest_stamp_bits(self, clock_hz: float) -> int:
        """Return the narrowest stamps of cells whose sweep a core has time for."""
        return self._design(clock_hz).narrowest_stamp_bits

    def judge(self, target: Target) -> Verdict:
        """Return the verdict on a part."""
        motion = self.ground.motion(self.cancel)
        if isinstance(target, FpgaTarget):
            return choose_core(
                self._design(self.clock_hz or target.clock.mhz * 1e6),
                target,
                motion,
                self.ground.events,
                self.offer,
                fixed=self.fixed,
            )
        from tiegocancel.firmware_sim.mcu.judge import judge_mcu

        return judge_mcu(
            target,
            self.cancel,
            motion,
            self.ground.events,
            self.offer,
            clock_hz=self.clock_hz or target.core.mhz * 1e6,
            config=self.mcu,
        )

    def may_fit(self, target: Target) -> bool:
        """Tell, without simulating, whether any way of building it fits a part."""
        motion = self.ground.motion(self.cancel)
        if isinstance(target, FpgaTarget):
            base = self._design(self.clock_hz or target.clock.mhz * 1e6)
            return any(fits(design, target, motion) for design in rungs(base, fixed=self.fixed))
        from tiegocancel.firmware_sim.mcu.judge import fits_mcu

        events = self.ground.events
        return fits_mcu(target, self.cancel, width=events.width, height=events.height)

    def _design(self, clock_hz: float) -> CoreDesign:
        events = self.ground.events
        design = CoreDesign(self.core, self.cancel, events.width, events.height, clock_hz, external=self.external)
        return replace(design, time_bits=design.narrowest_stamp_bits) if self.narrow_stamps else design


def offer_of(settings: BudgetSettings, target: Target) -> Offer:
    """Return the links of a part: as the settings say, else a microcontroller's fastest, else as wide as it takes."""
    fastest = 0.0
    if not isinstance(target, FpgaTarget):
        fastest = max((8.0 * link.bytes_per_second for link in target.links if link.input), default=0.0)
    leaving = 0.0
    if not isinstance(target, FpgaTarget):
        leaving = max((8.0 * link.bytes_per_second for link in target.links if link.output), default=0.0)
    return Offer(
        input=InputPath(
            readout_events_per_second=settings.readout_events_per_second,
            link_bits_per_second=settings.input_link_bits_per_second or fastest,
            bits_per_event=settings.input_bits_per_event,
            buffer_events=settings.sensor_buffer_events,
        ),
        output_bits_per_second=settings.output_link_bits_per_second or leaving,
        output_bits_per_event=settings.output_bits_per_event,
        max_latency_us=settings.max_latency_us,
    )
