"""Judge a matching core on an FPGA: simulate it, map it, compare what it needs with what the part has."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from tiegocancel.firmware_sim.constraint import Constraint
from tiegocancel.firmware_sim.core.design import CoreDesign
from tiegocancel.firmware_sim.core.plan import fastest_scrub
from tiegocancel.firmware_sim.core.simulator import CoreSimulator
from tiegocancel.firmware_sim.energy import estimate_energy
from tiegocancel.firmware_sim.logic import LogicEstimate, estimate_logic
from tiegocancel.firmware_sim.memory_map import MemoryMap, map_memories
from tiegocancel.firmware_sim.offer import Offer
from tiegocancel.firmware_sim.outcome import DEEP, Mode, Outcome, run_device
from tiegocancel.firmware_sim.pace import burst_events, link_table, pace_constraints
from tiegocancel.firmware_sim.target_fpga import FpgaTarget
from tiegocancel.firmware_sim.verdict import Verdict

from tiegocancel.events import Events
from tiegocancel.matching.selective import Schedules
from tiegocancel.motion.schedule import MotionSchedule

__all__ = ["describe", "fit_constraints", "judge_core", "simulate_core"]


def judge_core(
    design: CoreDesign,
    target: FpgaTarget,
    motion: MotionSchedule | Schedules,
    events: Events,
    offer: Offer,
    *,
    outcome: Outcome | None = None,
) -> Verdict:
    """Return the verdict; ``outcome`` is used where the same design has been simulated before."""
    memory_map = map_memories(design.memories(), target)
    logic = estimate_logic(design.logic(), target, memory_luts=memory_map.luts, memory_ffs=memory_map.ffs)
    constraints = fit_constraints(design, target, memory_map, logic, motion)
    remarks = [f"clock of {design.clock_hz * 1e-6:.4g} MHz: {_clock_basis(target, design.clock_hz)}"]
    remarks += [f"logic: {reason}" for reason in logic.reasons]
    if design.scrub_cycles < fastest_scrub(design.core):
        remarks.append("not simulated: the sweep of the stamps takes every cycle; give them more bits")
        outcome = None
    elif outcome is None:
        outcome = simulate_core(design, motion, events, offer)
    utilisation: dict[str, float] = {}
    link: dict[str, Any] = {}
    if outcome is not None:
        constraints += pace_constraints(outcome, events, design.cancel, offer, input_depth=design.core.input_depth)
        constraints.append(_sweep(design, outcome))
        utilisation = _utilisation(design, outcome)
        link = link_table(outcome, events, offer)
    energy = estimate_energy(target, cycles_per_event=0.0 if outcome is None else outcome.pace.mean)
    return Verdict(
        target=target.name,
        kind="fpga",
        design=describe(design),
        clock_hz=design.clock_hz,
        constraints=constraints,
        outcome=outcome,
        memory=_memory_rows(memory_map),
        logic={
            "luts": logic.luts,
            "ffs": logic.ffs,
            "multipliers": logic.multipliers,
            "error_share": logic.error_share,
        },
        utilisation=utilisation,
        link=link,
        burst_events=math.nan if outcome is None else burst_events(outcome, offer, input_depth=design.core.input_depth),
        energy=energy.text,
        startup_us=design.startup_cycles / design.clock_hz * 1e6,
        remarks=remarks,
    )


def simulate_core(design: CoreDesign, motion: MotionSchedule | Schedules, events: Events, offer: Offer) -> Outcome:
    """Run a design on events as they arrive, and saturated."""

    def make(mode: Mode) -> CoreSimulator:
        saturated = mode == "saturated"
        return CoreSimulator(
            replace(design.core, input_depth=DEEP) if mode == "deep" else design.core,
            design.cancel,
            motion,
            width=design.width,
            height=design.height,
            scrub_cycles=design.scrub_cycles,
            link_q16=0 if saturated else offer.link_q16(design.clock_hz),
            saturated=saturated,
        )

    return run_device(make, events, offer, clock_hz=design.clock_hz, warm_up_us=design.cancel.warm_up_us)


def fit_constraints(
    design: CoreDesign,
    target: FpgaTarget,
    memory_map: MemoryMap,
    logic: LogicEstimate,
    motion: MotionSchedule | Schedules,
) -> list[Constraint]:
    """Return every constraint of the part."""
    found = [
        Constraint(
            name=f"RAM: {use.kind}",
            kind="fit",
            need=use.need,
            have=use.have,
            unit="blocks",
            evidence="exact",
            note=f"{use.usable} with room to route",
        )
        for use in memory_map.uses
        if use.need
    ]
    if memory_map.unplaced:
        found.append(
            Constraint(
                name="RAM: no place for " + ", ".join(one.name for one in memory_map.unplaced),
                kind="fit",
                need=sum(one.bits for one in memory_map.unplaced),
                have=0,
                unit="bit",
                evidence="exact",
            )
        )
    for name, need, have, share in (
        ("LUTs", logic.luts, target.logic.luts, target.usable.luts),
        ("flip-flops", logic.ffs, target.logic.ffs, target.usable.ffs),
        ("multipliers", logic.multipliers, sum(one.count for one in target.multipliers), target.usable.multipliers),
    ):
        found.append(
            Constraint(
                name=name,
                kind="fit",
                need=need,
                have=int(have * share),
                unit="",
                evidence="estimated",
                error_share=logic.error_share,
                note=f"of {have:,}; ± {logic.error_share:.0%}",
            )
        )
    if design.external is not None and design.core.table_memory == "external":
        found.append(
            Constraint(
                name="external memory",
                kind="fit",
                need=design.state.cells * -(-design.state.cell // 8),
                have=design.external.bytes,
                unit="bytes",
                evidence="datasheet",
                note=f"{design.external.part}; a line missed takes {design.core.miss_cycles} cycles",
            )
        )
    fastest = max(clock.mhz for clock in target.clocks)
    if abs(design.clock_hz - target.clock.mhz * 1e6) > 1:  # the part's own clock leaves no margin by definition
        found.append(
            Constraint(
                name="clock",
                kind="fit",
                need=design.clock_hz * 1e-6,
                have=fastest if design.clock_hz > target.clock.mhz * 1e6 else target.clock.mhz,
                unit="MHz",
                evidence="datasheet",
                note=_clock_basis(target, design.clock_hz),
            )
        )
    schedules = motion if isinstance(motion, tuple) else (motion,)
    widest = max(int(np.abs(one.coefficients[:, [0, 1, 3, 4]]).max()) for one in schedules).bit_length() + 1
    found.append(
        Constraint(
            name="coefficient",
            kind="fit",
            need=max(widest - 16 + design.core.coefficient_fraction_bits, 1),
            have=design.core.coefficient_fraction_bits + 2,
            unit="bit",
            evidence="exact",
            note="widest of a, b, d, e with its sign",
        )
    )
    return found


def describe(design: CoreDesign) -> str:
    """Say a micro-architecture in a few words."""
    core = design.core
    words = [f"{core.lookup} look-up", {"none": "one at a time"}.get(core.overlap, core.overlap)]
    if core.lanes > 1:
        words.append(f"{core.lanes} lanes")
    if core.table_memory != "block":
        words.append({"single_port": "single-port table", "external": "external table"}[core.table_memory])
    words.append(f"{design.stamp_bits}-bit stamps")
    return ", ".join(words)


def _sweep(design: CoreDesign, outcome: Outcome) -> Constraint:
    """Return the constraint of the sweep that hides aliases: words a second against what idle cycles allow."""
    busy = min(outcome.work["table_reads"] / max(outcome.cycles, 1) / max(design.core.lanes, 1), 1.0)
    service = fastest_scrub(design.core) / 2
    return Constraint(
        name="sweep of stamps",
        kind="pace",
        need=design.clock_hz / max(design.scrub_cycles, 1),
        have=design.clock_hz * (1.0 - busy) / service,
        unit="words/s",
        evidence="simulated",
        note=f"{design.stamp_bits}-bit stamps, {design.table_words:,} words in {design.sweep_ticks:,} ticks",
    )


def _utilisation(design: CoreDesign, outcome: Outcome) -> dict[str, float]:
    """Return the share of cycles in which each part is busy."""
    cycles, core = max(outcome.cycles, 1), design.core
    ports = cycles * core.lanes
    ring = outcome.counts["predicted"]
    return {
        "table read port": outcome.work["table_reads"] / ports,
        "table write port": outcome.work["table_writes"] / ports,
        "ring write port": ring / cycles,
        "ring read port": outcome.counts["passes"] / cycles,
        "predict multipliers": outcome.work["predict_maps"]
        * len(design.cancel.horizons_us)
        * -(-4 // core.predict_multipliers)
        / cycles,
        "drain multipliers": 0.0
        if design.cancel.is_plain
        else outcome.work["drain_maps"] * -(-4 // core.drain_multipliers) / cycles,
        "sweep": outcome.work["scrubs"] / cycles,
    }


def _memory_rows(memory_map: MemoryMap) -> list[dict[str, Any]]:
    """Return where every memory went."""
    return [
        {
            "name": one.memory.name,
            "words": one.memory.words,
            "width_bits": one.memory.width_bits,
            "bits": one.memory.bits,
            "kind": one.kind,
            "blocks": one.blocks,
            "mode": f"{one.mode[0]}×{one.mode[1]}",
            "waste_bits": one.waste_bits,
            "fits": one.fits,
        }
        for one in memory_map.placements
    ]


def _clock_basis(target: FpgaTarget, clock_hz: float) -> str:
    """Say what the clock rests on."""
    for clock in target.clocks:
        if clock_hz <= clock.mhz * 1e6 * (1 + 1e-9):
            return f"grade {clock.grade}, {clock.basis}"
    return "beyond what the part is known to reach"
