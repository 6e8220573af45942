"""Judge a firmware on a microcontroller: place its arrays, time it, compare what it needs with what the part has."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from tiegocancel.firmware_sim.constraint import Constraint
from tiegocancel.firmware_sim.energy import estimate_energy
from tiegocancel.firmware_sim.mcu.config import McuConfig
from tiegocancel.firmware_sim.mcu.simulator import McuSimulator
from tiegocancel.firmware_sim.offer import Offer
from tiegocancel.firmware_sim.outcome import DEEP, Mode, Outcome, run_device
from tiegocancel.firmware_sim.pace import burst_events, link_table, pace_constraints
from tiegocancel.firmware_sim.ram_map import RamMap
from tiegocancel.firmware_sim.target_mcu import McuTarget
from tiegocancel.firmware_sim.verdict import Verdict

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules
from tiegocancel.motion.schedule import MotionSchedule

__all__ = ["fits_mcu", "judge_mcu"]

_DEEPEST_INPUT = 1 << 13


@dataclass(frozen=True)
class _Firmware:
    """One firmware on one part, before it is judged."""

    target: McuTarget
    config: McuConfig
    cancel: CancelConfig
    motion: MotionSchedule | Schedules
    width: int
    height: int

    def simulator(self, *, saturated: bool = False, link_q16: int = 0, deep: bool = False) -> McuSimulator:
        """Return a simulator; ``deep`` gives it an input queue that never fills, its arrays where they are."""
        return McuSimulator(
            self.target,
            self.config,
            self.cancel,
            self.motion,
            width=self.width,
            height=self.height,
            saturated=saturated,
            link_q16=link_q16,
            queue_depth=DEEP if deep else 0,
        )


def judge_mcu(
    target: McuTarget,
    cancel: CancelConfig,
    motion: MotionSchedule | Schedules,
    events: Events,
    offer: Offer,
    *,
    clock_hz: float,
    config: McuConfig | None = None,
) -> Verdict:
    """Return the verdict on the simplest firmware that passes, or on the best of those tried.

    Without ``config``: one core and a buffer of 512 events; then a deeper buffer where only that is missing; then, on
    a part with two cores, one of them for interrupts and links.
    """
    clocked = replace(target, core=replace(target.core, mhz=clock_hz * 1e-6))
    made = [config or McuConfig()]
    if config is None and target.core.count > 1:
        made.append(McuConfig(cores=2))
    best: Verdict | None = None
    for one in made:
        firmware = _Firmware(clocked, one, cancel, motion, events.width, events.height)
        verdict = _judge(firmware, target, events, offer)
        outcome = verdict.outcome
        if config is None and outcome is not None and one.input_depth < outcome.input_need <= _DEEPEST_INPUT:
            depth = 1 << (outcome.input_need - 1).bit_length()
            deeper = _judge(replace(firmware, config=replace(one, input_depth=depth)), target, events, offer)
            verdict = deeper if deeper.fits else verdict
        if verdict.passes:
            return verdict
        if best is None or verdict.binding.margin > best.binding.margin:
            best = verdict
    assert best is not None
    return best


def fits_mcu(target: McuTarget, cancel: CancelConfig, *, width: int, height: int) -> bool:
    """Tell, without simulating, whether the arrays of the simplest firmware find a place."""
    try:
        made = _Firmware(target, McuConfig(), cancel, MotionSchedule.still(), width, height).simulator()
    except (ValueError, MemoryError):
        return False
    return made.fits


def _judge(firmware: _Firmware, target: McuTarget, events: Events, offer: Offer) -> Verdict:
    """Judge one firmware."""
    clock_hz = firmware.target.core.mhz * 1e6
    common: dict[str, Any] = {"target": target.name, "kind": "mcu", "clock_hz": clock_hz}
    try:
        probe = firmware.simulator()
    except ValueError as error:
        row = Constraint(name="firmware", kind="fit", need=1, have=0, unit="", evidence="exact", note=str(error))
        return Verdict(design=_words(firmware, None), constraints=[row], outcome=None, remarks=[str(error)], **common)
    constraints = _fit(probe, firmware, target)
    outcome: Outcome | None = None
    remarks = [] if target.core.issue_width == 1 else ["two instructions may issue at once: cycles are an upper bound"]

    def make(mode: Mode) -> McuSimulator:
        saturated = mode == "saturated"
        return firmware.simulator(
            saturated=saturated, deep=mode == "deep", link_q16=0 if saturated else offer.link_q16(clock_hz)
        )

    if probe.fits:
        outcome = run_device(make, events, offer, clock_hz=clock_hz, warm_up_us=firmware.cancel.warm_up_us)
        constraints += pace_constraints(
            outcome,
            events,
            firmware.cancel,
            offer,
            input_depth=firmware.config.input_depth,
            error_share=probe.error_share,
        )
    else:
        remarks.append("not simulated: its arrays find no place")
    energy = estimate_energy(target, cycles_per_event=0.0 if outcome is None else outcome.pace.mean)
    return Verdict(
        design=_words(firmware, probe),
        constraints=constraints,
        outcome=outcome,
        memory=_memory_rows(probe.ram),
        utilisation={} if outcome is None else _utilisation(outcome),
        link={} if outcome is None else link_table(outcome, events, offer),
        burst_events=math.nan
        if outcome is None
        else burst_events(outcome, offer, input_depth=firmware.config.input_depth),
        energy=energy.text if outcome is not None else "no figure",
        remarks=[*remarks, f"cycles an event may be off by {probe.error_share:.0%}"],
        **common,
    )


def _fit(probe: McuSimulator, firmware: _Firmware, target: McuTarget) -> list[Constraint]:
    """Return the constraints of the part."""
    ram = probe.ram
    found = [
        Constraint(
            name="RAM",
            kind="fit",
            need=ram.need_bytes,
            have=ram.have_bytes,
            unit="bytes",
            evidence="exact",
            note=f"{ram.reserve_bytes:,} of them for stack and buffers",
        )
    ]
    homeless = [one.array for one in ram.placements if not one.fits]
    if homeless and ram.need_bytes <= ram.have_bytes:
        largest = max(array.bytes for array in homeless)
        within_reach = ram.largest_free_bytes < largest  # otherwise what is free is where DMA does not reach
        found.append(
            Constraint(
                name="RAM in one piece",
                kind="fit",
                need=largest,
                have=ram.largest_free_bytes if within_reach else 0,
                unit="bytes",
                evidence="exact",
                note="for "
                + ", ".join(array.name for array in homeless)
                + ("" if within_reach else ", that DMA reaches"),
            )
        )
    if abs(firmware.target.core.mhz - target.core.mhz) > 1e-6:
        found.append(
            Constraint(
                name="clock",
                kind="fit",
                need=firmware.target.core.mhz,
                have=target.core.mhz,
                unit="MHz",
                evidence="datasheet",
            )
        )
    return found


def _words(firmware: _Firmware, probe: McuSimulator | None) -> str:
    """Say a firmware in a few words."""
    config = firmware.config
    source = {"dma": "DMA in", "blocks": "double-buffered DMA in", "interrupt": "an interrupt an event"}[config.input]
    words = [f"{firmware.target.core.name}, {source}", f"code in {config.code}", f"-{config.optimisation}"]
    if config.cores > 1:
        words.append("a second core for interrupts")
    if probe is not None:
        words.append(f"cells of {probe.words.cell} bits, ring entries of {probe.words.ring_entry}")
    return ", ".join(words)


def _utilisation(outcome: Outcome) -> dict[str, float]:
    """Return the share of all cycles that the core spent on each thing."""
    return {name.replace("_", " "): cycles / max(outcome.cycles, 1) for name, cycles in outcome.work.items()}


def _memory_rows(ram: RamMap) -> list[dict[str, Any]]:
    """Return where every array went."""
    return [
        {
            "name": one.array.name,
            "words": one.array.words,
            "width_bits": one.array.width_bits,
            "bits": 8 * one.array.bytes,
            "kind": " + ".join(one.banks) or "nowhere",
            "blocks": 0,
            "mode": "",
            "waste_bits": one.array.padding_bits,
            "fits": one.fits,
        }
        for one in ram.placements
    ]
