"""``$readmemh`` of a Verilog simulator reads the memory images as they were meant."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiegocancel.firmware_sim.export import golden_vectors, write_vectors
from tiegocancel.firmware_sim.export.layout import vector_words
from tiegocancel.firmware_sim.export.words import read_memh

BENCH = """module bench;
  reg [{high}:0] m [0:{last}];
  integer i;
  initial begin
    $readmemh("{path}", m);
    for (i = 0; i <= {last}; i = i + 1) $display("{formats}", {fields});
  end
endmodule
"""


@pytest.fixture(scope="module")
def simulator() -> str:
    found = shutil.which("iverilog")
    if found is None:
        pytest.skip("no Verilog simulator (iverilog) is here")
    return found


@pytest.mark.parametrize("seed", range(4))
def test_a_verilog_simulator_reads_every_field(
    draw: Callable[[int], Any], simulator: str, tmp_path: Path, seed: int
) -> None:
    config, events, schedules = draw(seed)
    vectors = golden_vectors(events, config, schedules)
    write_vectors(tmp_path, vectors, command=[])
    for name, word in vector_words(vectors).items():
        rows = read_memh(tmp_path / name, word)
        fields = [
            f"{'$signed' if field.signed else ''}(m[i][{at + field.bits - 1}:{at}])" for field, at in word.placed()
        ]
        text = BENCH.format(
            high=word.bits - 1,
            last=len(rows) - 1,
            path=tmp_path / name,
            formats=" ".join(["%0d"] * len(fields)),
            fields=", ".join(fields),
        )
        (tmp_path / "bench.v").write_text(text)
        subprocess.run([simulator, "-o", str(tmp_path / "bench"), str(tmp_path / "bench.v")], check=True)
        told = subprocess.run([str(tmp_path / "bench")], capture_output=True, text=True, check=True)
        assert (told.stderr, "WARNING" in told.stdout) == ("", False)
        assert [tuple(map(int, line.split())) for line in told.stdout.splitlines()] == rows
    assert np.array_equal(
        [row[1] for row in read_memh(tmp_path / "events.memh", vector_words(vectors)["events.memh"])], events.x
    )
