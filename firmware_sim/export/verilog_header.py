"""Write constants as a Verilog header: ``localparam`` for a number, a packed vector for a list."""

from __future__ import annotations

from collections.abc import Sequence

from tiegocancel.firmware_sim.export.constants import Constant
from tiegocancel.firmware_sim.export.words import signed_bits, unsigned_bits

__all__ = ["VERILOG_HEADER", "verilog_header"]

VERILOG_HEADER = "tiegocancel_config.vh"


def verilog_header(parameters: Sequence[Constant]) -> str:
    """Return the text, to be included within a module; Verilog-2001.

    Element ``i`` of a list is ``NAME[i*NAME_BITS +: NAME_BITS]``, in two's complement where it can be negative.
    """
    lines = [f"// {VERILOG_HEADER}: written by tiegocancel export, see README.txt; include it within a module."]
    for one in parameters:
        name = f"TIEGOCANCEL_{one.name.upper()}"
        if isinstance(one.value, int):
            kind = " signed [63:0]" if one.signed else f" [{max(unsigned_bits(one.value), 32) - 1}:0]"
            lines.append(f"localparam{kind} {name} = {_decimal(one.value, one.signed)}; // {one.text}")
            continue
        low, high = min(one.value), max(one.value)
        bits = signed_bits(low, high) if one.signed else unsigned_bits(high)
        packed = sum((value & ((1 << bits) - 1)) << (bits * index) for index, value in enumerate(one.value))
        total = bits * len(one.value)
        lines.append(f"localparam [31:0] {name}_BITS = 32'd{bits};")
        lines.append(f"localparam [{total - 1}:0] {name} = {_hex(packed, total)}; // {len(one.value)}: {one.text}")
    return "\n".join(lines) + "\n"


def _decimal(value: int, signed: bool) -> str:
    """Return a sized number; a sign stands before it."""
    if signed:
        return f"{'-' if value < 0 else ''}64'sd{abs(value)}"
    return f"{max(unsigned_bits(value), 32)}'d{value}"


def _hex(value: int, width: int) -> str:
    return f"{width}'h{value & ((1 << width) - 1):x}"
