"""Look for the smallest changes that turn a fail into a pass, and what each costs in cancellation."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tiegocancel.firmware_sim.outcome import Outcome
from tiegocancel.firmware_sim.target import Target
from tiegocancel.firmware_sim.target_fpga import FpgaTarget
from tiegocancel.firmware_sim.verdict import Verdict
from tiegocancel.matching.config import CancelConfig
from tiegocancel.study.budget.ground import Cancelled, Ground
from tiegocancel.study.budget.subject import Subject

__all__ = ["Change", "Tried", "proposals", "search_changes"]

_MOST_SIMULATED = 24


@dataclass(frozen=True, slots=True)
class Change:
    """One change, in words, and how it is made; ``make`` returns ``None`` where it does not apply."""

    name: str
    make: Callable[[Subject], Subject | None]


@dataclass(frozen=True, slots=True)
class Tried:
    """A change, or several together, with which a part passes.

    ``loss``: of ``J``, or of the ratio where there are no labels.
    """

    name: str
    verdict: Verdict
    cancelled: Cancelled
    loss: float


def search_changes(
    subject: Subject, target: Target, verdict: Verdict, ideal: Callable[[Ground], Cancelled], *, most: int
) -> tuple[list[Tried], int]:
    """Return changes that pass, the least loss first, and how many were simulated.

    ``ideal`` returns what an unlimited device cancels on a ground: what a loss is measured from, on the region that is
    left where one was cut. Single changes first; two, three and four together only where fewer do not pass. What
    cannot fit is not simulated.
    """
    changes = list(proposals(subject, target, verdict))
    simulated = 0
    for size in (1, 2, 3, 4):
        passing: list[Tried] = []
        for together in itertools.combinations(changes, size):
            changed: Subject | None = subject
            for change in together:
                changed = None if changed is None else change.make(changed)
            if simulated >= _MOST_SIMULATED * size:
                break
            if changed is None or not len(changed.ground.events) or not changed.may_fit(target):
                continue
            simulated += 1
            found = changed.judge(target)
            if not found.passes or found.outcome is None:
                continue
            after = changed.ground.cancelled(found.outcome.suppressed, changed.cancel)
            name = " and ".join(change.name for change in together)
            passing.append(Tried(name, found, after, ideal(changed.ground).worth - after.worth))
        if passing:
            return sorted(passing, key=lambda one: one.loss)[:most], simulated
    return [], simulated


def proposals(subject: Subject, target: Target, verdict: Verdict) -> Iterator[Change]:
    """Yield changes that could help against what fails."""
    failing = {one.name: one.need for one in verdict.constraints if not one.ok}
    if verdict.outcome is None:
        failing["mean rate"] = 0.0
    if any(name.startswith("RAM") for name in failing):
        yield from _smaller(subject, verdict.outcome)
        if isinstance(target, FpgaTarget):
            bits = subject.narrowest_stamp_bits(verdict.clock_hz)
            yield Change(f"stamps of {bits} bits", _narrow_stamps)
    if "multipliers" in failing:
        yield Change("coefficients of 14 fraction bits", _narrow)
        for count in (2, 1):
            words = f"{count} multiplier{'s' if count > 1 else ''} for each place"
            yield Change(words, partial(_fewer_multipliers, count=count))
    if failing.keys() & {"LUTs", "flip-flops", "multipliers"}:
        yield Change("a spatial gate of 0 px", partial(_nearer, tolerance_px=0.0))
    if failing.keys() & {"mean rate", "input FIFO", "latency", "sweep of stamps"}:
        yield from _faster(subject, target)
    if "ring" in failing:
        entries = _rounded(failing["ring"])
        yield Change(f"a ring of {entries:,} entries", partial(_with, ring_capacity=entries))
        yield Change("half the horizon", _half_horizon)
    for name, line in (("output link", _output_line), ("input link", _input_line)):
        if name in failing:
            rate = failing[name] * 1.25
            yield Change(f"an {name.split()[0]} line of {rate * 1e-6:.3g} Mbit/s", partial(line, rate=rate))
    if failing.keys() & {"mean rate", "input FIFO", "input link", "lost at the sensor", "output link"}:
        yield Change("the middle half of the sensor (ROI)", _middle)


def _smaller(subject: Subject, outcome: Outcome | None) -> Iterator[Change]:
    """Yield what takes memory away."""
    if outcome is not None and not outcome.counts["overflow"] and not subject.cancel.chooses:
        entries = _rounded(outcome.counts["ring_high_water"])
        if entries < 0.9 * subject.cancel.ring_capacity:
            yield Change(f"a ring of {entries:,} entries", partial(_with, ring_capacity=entries))
    for bits in (1, 2):
        side = 1 << (subject.cancel.bin_bits + bits)
        yield Change(f"bins of {side}×{side} px", partial(_with, bin_bits=subject.cancel.bin_bits + bits))
    for bits in (2, 4):
        tick_us = 1 << (subject.cancel.tick_bits + bits)
        yield Change(f"ticks of {tick_us:,} µs", partial(_coarser, bits=bits))
    yield Change("cells in sets", _in_sets)
    yield Change("half the horizon", _half_horizon)
    yield Change("a quarter of the horizon", _quarter_horizon)
    yield Change("the middle half of the sensor (ROI)", _middle)


def _faster(subject: Subject, target: Target) -> Iterator[Change]:
    """Yield what takes cycles away, or spreads them."""
    if subject.cancel.tick_bits >= 2:  # what falls due in one tick is drained at once
        yield Change(f"ticks of {1 << (subject.cancel.tick_bits - 2):,} µs", partial(_finer, bits=2))
    if isinstance(target, FpgaTarget):
        for lanes in (2, 4):
            yield Change(f"{lanes} lanes", partial(_lanes, count=lanes))
        for mhz in sorted({clock.mhz for clock in target.clocks if clock.mhz > target.clock.mhz}):
            yield Change(f"a clock of {mhz:g} MHz", partial(_clocked, mhz=mhz))
    for tolerance_px in (1.0, 0.0):
        yield Change(f"a spatial gate of {tolerance_px:g} px", partial(_nearer, tolerance_px=tolerance_px))


def _narrow(subject: Subject) -> Subject | None:
    """Round the motion's coefficients, so that a product fits a multiplier of 16 bits."""
    if subject.core.coefficient_fraction_bits <= 14:
        return None
    return replace(subject, core=replace(subject.core, coefficient_fraction_bits=14))


def _fewer_multipliers(subject: Subject, count: int) -> Subject:
    """Form the four products of a place one after another."""
    return replace(subject, core=replace(subject.core, predict_multipliers=count, drain_multipliers=count))


def _finer(subject: Subject, bits: int) -> Subject | None:
    """Make ticks shorter; every time stays."""
    return _with(subject, tick_bits=subject.cancel.tick_bits - bits)


def _narrow_stamps(subject: Subject) -> Subject:
    """Narrow the stamps; the sweep goes round more often."""
    return replace(subject, narrow_stamps=True)


def _middle(subject: Subject) -> Subject:
    """Keep the middle of the sensor."""
    return replace(subject, ground=subject.ground.middle())


def _lanes(subject: Subject, count: int) -> Subject:
    """Split the table into tiles."""
    return replace(subject, core=replace(subject.core, lookup="banked", overlap="forward", lanes=count), fixed=True)


def _clocked(subject: Subject, mhz: float) -> Subject:
    """Take another speed grade."""
    return replace(subject, clock_hz=mhz * 1e6)


def _output_line(subject: Subject, rate: float) -> Subject:
    """Take a faster line out."""
    return replace(subject, offer=replace(subject.offer, output_bits_per_second=rate))


def _input_line(subject: Subject, rate: float) -> Subject:
    """Take a faster line in."""
    return replace(subject, offer=replace(subject.offer, input=replace(subject.offer.input, link_bits_per_second=rate)))


def _with(subject: Subject, **fields: object) -> Subject | None:
    """Return the subject with fields of its canceller changed, ``None`` where they contradict each other."""
    try:
        cancel: CancelConfig = replace(subject.cancel, **fields)  # type: ignore[arg-type]
    except ValueError:
        return None
    return None if cancel == subject.cancel else replace(subject, cancel=cancel)


def _half_horizon(subject: Subject) -> Subject | None:
    """Halve horizons and rings; gates stay, so that what a prediction may err by stays."""
    cancel, tick = subject.cancel, 1 << subject.cancel.tick_bits
    halves = [max(horizon_us // 2 // tick, 1) * tick for horizon_us in cancel.horizons_us]
    fields: dict[str, object] = {
        "horizon_us": halves[0],
        "more_horizons_us": tuple(halves[1:]),
        "ring_capacity": max(cancel.ring_capacity // 2, 1),
        "more_ring_capacities": tuple(max(one // 2, 1) for one in cancel.more_ring_capacities),
    }
    return _with(subject, **fields)


def _quarter_horizon(subject: Subject) -> Subject | None:
    """Halve horizons and rings twice."""
    once = _half_horizon(subject)
    return None if once is None else _half_horizon(once)


def _coarser(subject: Subject, bits: int) -> Subject | None:
    """Make ticks longer; horizons and gates go to the nearest whole ticks, gates to one at least."""
    cancel = subject.cancel
    tick = 1 << (cancel.tick_bits + bits)

    def whole(value_us: int, least: int) -> int:
        return max(round(value_us / tick), least) * tick

    fields: dict[str, object] = {
        "tick_bits": cancel.tick_bits + bits,
        "horizon_us": whole(cancel.horizon_us, 2),
        "more_horizons_us": tuple(whole(one, 2) for one in cancel.more_horizons_us),
        "early_us": whole(cancel.early_gate_us, 1),
        "late_us": whole(cancel.late_gates_us[1], 1),
    }
    if cancel.off_late_us is not None:
        fields["off_late_us"] = whole(cancel.off_late_us, 1)
    return _with(subject, **fields)


def _in_sets(subject: Subject) -> Subject | None:
    """Keep only as many cells as twice the predictions that are open at once, in sets of 8."""
    cancel, events = subject.cancel, subject.ground.events
    if cancel.set_bits is not None:
        return None
    rate = len(events) / max(events.span_us, 1)
    open_at_once = rate * (cancel.early_gate_us + cancel.late_gate_us + (1 << cancel.tick_bits))
    bits = max(int(np.ceil(np.log2(max(2.0 * open_at_once / 8.0, 1.0)))), 1)
    columns = -(-bits // 2)
    return _with(subject, set_bits=(columns, bits - columns), ways=8)


def _nearer(subject: Subject, tolerance_px: float) -> Subject | None:
    """Narrow the gate in space."""
    if subject.cancel.tolerance_px <= tolerance_px:
        return None
    return _with(subject, tolerance_px=tolerance_px)


def _rounded(need: float) -> int:
    """Return an eighth more than what was needed, in steps of 64 entries."""
    return int(-(-need * 1.125 // 64)) * 64
