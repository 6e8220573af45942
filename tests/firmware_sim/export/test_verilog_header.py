"""A Verilog simulator reads every parameter of the header as it was meant."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tiegocancel.firmware_sim.export import golden_vectors
from tiegocancel.firmware_sim.export.constants import Constant, constants
from tiegocancel.firmware_sim.export.verilog_header import VERILOG_HEADER, verilog_header


@pytest.fixture(scope="module")
def simulator() -> str:
    found = shutil.which("iverilog")
    if found is None:
        pytest.skip("no Verilog simulator (iverilog) is here")
    return found


def shown(one: Constant) -> str:
    """Return the statement that prints a parameter, a line for each of its numbers."""
    name = f"TIEGOCANCEL_{one.name.upper()}"
    if isinstance(one.value, int):
        return f'$display("%0d", {name});'
    read, shift = f"{name}[i*{name}_BITS +: {name}_BITS]", f"(64 - {name}_BITS)"
    loop = f"for (i = 0; i < {len(one.value)}; i = i + 1)"
    if one.signed:
        return f'{loop} begin wide = {read}; wide = wide << {shift}; $display("%0d", wide >>> {shift}); end'
    return f'{loop} $display("%0d", {read});'


@pytest.mark.parametrize("seed", range(6))
def test_every_parameter_is_read(draw: Callable[[int], Any], simulator: str, tmp_path: Path, seed: int) -> None:
    config, events, schedules = draw(seed)
    parameters = constants(golden_vectors(events, config, schedules))
    (tmp_path / VERILOG_HEADER).write_text(verilog_header(parameters), encoding="ascii")
    lines = [
        "module bench;",
        f'  `include "{VERILOG_HEADER}"',
        "  integer i;",
        "  reg signed [63:0] wide;",
        "  initial begin",
        *(f"    {shown(one)}" for one in parameters),
        "  end",
        "endmodule",
    ]
    (tmp_path / "bench.v").write_text("\n".join(lines) + "\n")
    made = ["-g2001", "-Wall", "-I", str(tmp_path), "-o", str(tmp_path / "bench"), str(tmp_path / "bench.v")]
    subprocess.run([simulator, *made], check=True)
    told = subprocess.run([str(tmp_path / "bench")], capture_output=True, text=True, check=True)
    expected = [number for one in parameters for number in (one.value if isinstance(one.value, tuple) else [one.value])]
    assert [int(line) for line in told.stdout.splitlines()] == expected
