"""Golden vectors and tables for firmware and RTL engineers: ``$readmemh``, C99 and JSON."""

from tiegocancel.firmware_sim.export.cycles import core_cycles
from tiegocancel.firmware_sim.export.read import read_vectors
from tiegocancel.firmware_sim.export.vectors import CoreCycles, Vectors, golden_vectors
from tiegocancel.firmware_sim.export.write import FILES, write_vectors

__all__ = ["FILES", "CoreCycles", "Vectors", "core_cycles", "golden_vectors", "read_vectors", "write_vectors"]
