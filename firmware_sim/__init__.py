"""The hardware side: what the canceller costs on a device. No Taichi, no serial port."""

from tiegocancel.firmware_sim.state import StateBits, state_bits

__all__ = ["StateBits", "state_bits"]
