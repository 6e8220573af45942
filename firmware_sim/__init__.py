"""The hardware side: what the canceller costs on a device. No Taichi, no serial port."""

from tiegocancel.firmware_sim.energy import EnergyEstimate, estimate_energy
from tiegocancel.firmware_sim.logic import LogicEstimate, LogicShape, estimate_logic
from tiegocancel.firmware_sim.memory_map import LogicalMemory, MemoryMap, map_memories
from tiegocancel.firmware_sim.ram_map import RamArray, RamMap, place_arrays
from tiegocancel.firmware_sim.state import StateBits, state_bits
from tiegocancel.firmware_sim.target import Target, load_memory, load_target, memory_names, target_names
from tiegocancel.firmware_sim.target_fpga import FpgaTarget
from tiegocancel.firmware_sim.target_mcu import McuTarget
from tiegocancel.firmware_sim.target_memory import ExternalMemory

__all__ = [
    "EnergyEstimate",
    "ExternalMemory",
    "FpgaTarget",
    "LogicEstimate",
    "LogicShape",
    "LogicalMemory",
    "McuTarget",
    "MemoryMap",
    "RamArray",
    "RamMap",
    "StateBits",
    "Target",
    "estimate_energy",
    "estimate_logic",
    "load_memory",
    "load_target",
    "map_memories",
    "memory_names",
    "place_arrays",
    "state_bits",
    "target_names",
]
