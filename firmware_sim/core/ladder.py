"""Choose the simplest micro-architecture that fits a part and keeps up there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.core.design import CoreDesign
from tiegocancel.firmware_sim.core.judge import fit_constraints, judge_core
from tiegocancel.firmware_sim.logic import estimate_logic
from tiegocancel.firmware_sim.memory_map import map_memories
from tiegocancel.firmware_sim.offer import Offer
from tiegocancel.firmware_sim.target_fpga import FpgaTarget
from tiegocancel.firmware_sim.verdict import Verdict

from tiegocancel.events import Events
from tiegocancel.matching.selective import Schedules
from tiegocancel.motion.schedule import MotionSchedule

__all__ = ["choose_core", "fits", "ladder", "rungs"]

_DEEPEST_INPUT = 1 << 14
_ENOUGH_RATE = 0.98


def ladder(base: CoreConfig, *, external: bool = False) -> Iterator[CoreConfig]:
    """Yield micro-architectures, the simplest first: each rung costs more logic or banks and takes fewer cycles.

    A table in an external memory, where there is one, comes last: it asks for a chip more.
    """
    yield replace(base, lookup="serial", overlap="none", lanes=1, table_memory="block")
    yield replace(base, lookup="serial", overlap="none", lanes=1, table_memory="single_port")
    yield replace(base, lookup="serial", overlap="forward", lanes=1, table_memory="block")
    yield replace(base, lookup="row", overlap="forward", lanes=1, table_memory="block")
    yield replace(base, lookup="banked", overlap="forward", lanes=1, table_memory="block")
    if external:
        yield replace(base, lookup="serial", overlap="none", lanes=1, table_memory="external")


def choose_core(
    base: CoreDesign,
    target: FpgaTarget,
    motion: MotionSchedule | Schedules,
    events: Events,
    offer: Offer,
    *,
    fixed: bool = False,
) -> Verdict:
    """Return the verdict on the first rung that fits and keeps up, or on the one that comes nearest to it.

    ``fixed`` judges ``base.core`` alone. A core that could keep up but drops events for want of a deeper input FIFO is
    given one, up to 16,384 events.
    """
    designs = rungs(base, fixed=fixed)
    fitting = [design for design in designs if fits(design, target, motion)]
    best: Verdict | None = None
    for design in fitting or designs[:1]:
        verdict = judge_core(design, target, motion, events, offer)
        if not fixed:
            verdict = _deeper(verdict, design, target, motion, events, offer)
        if verdict.passes:
            return verdict
        if best is None or verdict.binding.margin > best.binding.margin:
            best = verdict
    assert best is not None
    return best


def rungs(base: CoreDesign, *, fixed: bool = False) -> list[CoreDesign]:
    """Return the designs to try for a base: its own core alone when ``fixed``."""
    cores = [base.core] if fixed else list(ladder(base.core, external=base.external is not None))
    return [replace(base, core=core) for core in cores]


def fits(design: CoreDesign, target: FpgaTarget, motion: MotionSchedule | Schedules) -> bool:
    """Tell whether a part holds a design, without simulating it."""
    memory_map = map_memories(design.memories(), target)
    logic = estimate_logic(design.logic(), target, memory_luts=memory_map.luts, memory_ffs=memory_map.ffs)
    return all(one.ok for one in fit_constraints(design, target, memory_map, logic, motion))


def _deeper(
    verdict: Verdict,
    design: CoreDesign,
    target: FpgaTarget,
    motion: MotionSchedule | Schedules,
    events: Events,
    offer: Offer,
) -> Verdict:
    """Judge anew with an input FIFO as deep as it takes, where that is what is missing."""
    outcome = verdict.outcome
    if outcome is None or not outcome.drops or outcome.input_need > _DEEPEST_INPUT:
        return verdict
    rate = len(events) / max(events.span_us, 1) * 1e6
    if outcome.max_events_per_second * _ENOUGH_RATE < rate:
        return verdict
    deep = replace(design, core=replace(design.core, input_depth=1 << (outcome.input_need - 1).bit_length()))
    if not fits(deep, target, motion):
        return verdict
    return judge_core(deep, target, motion, events, offer)
