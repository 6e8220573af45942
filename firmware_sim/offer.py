"""Say what surrounds a device: how events come in, how residuals leave, how soon they must."""

from __future__ import annotations

from dataclasses import dataclass, field

from tiegocancel.firmware_sim.arrival import InputPath

__all__ = ["Offer"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Offer:
    """The input path, the output line, and the latest decision that is soon enough.

    ``output_bits_per_second``: 0 for a line as wide as it takes; ``output_bits_per_event`` on it. ``max_latency_us``
    from arrival to decision, 0 for any.
    """

    input: InputPath = field(default_factory=InputPath)
    output_bits_per_second: float = 0.0
    output_bits_per_event: float = 32.0
    max_latency_us: float = 0.0

    def __post_init__(self) -> None:
        value = self.output_bits_per_second
        if value != 0 and not 1 <= value <= 1e15:
            raise ValueError(f"output_bits_per_second must be 0 or from 1 to 1e15, not {value!r}")
        if not 0 < self.output_bits_per_event <= 4096:
            raise ValueError(
                f"output_bits_per_event must be above 0 and at most 4096, not {self.output_bits_per_event!r}"
            )
        if not 0 <= self.max_latency_us < 1e12:
            raise ValueError(f"max_latency_us must be from 0 to 1e12, not {self.max_latency_us!r}")

    def link_q16(self, clock_hz: float) -> int:
        """Return the cycles that the output line takes for a residual, in 2^-16."""
        if not self.output_bits_per_second:
            return 0
        return min(round(clock_hz * self.output_bits_per_event / self.output_bits_per_second * (1 << 16)), 1 << 46)
