"""A sweep gives the same table wherever it runs, and goes on where it was killed."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from tiegocancel.errors import TiegoCancelError
from tiegocancel.study.sweep import Engine, Inline, Pace, Processes, ResultStore, Task, run_sweep, write_table

HERE = Path(__file__).parent
JOBS = [{"n": number, "kind": "odd" if number % 2 else "even"} for number in range(20)]
WANTED = [job["n"] ** 2 for job in JOBS]


@pytest.fixture(scope="module")
def chores() -> ModuleType:
    """Import the jobs under a name that other processes can import too."""
    sys.path.insert(0, str(HERE))
    os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")])
    import chores

    return chores


@pytest.mark.parametrize("engine", [Inline(), Processes(2)], ids=["inline", "processes"])
def test_every_job_has_its_row_in_order(tmp_path: Path, chores: ModuleType, engine: Engine) -> None:
    with ResultStore(tmp_path / "r.jsonl") as store:
        result = run_sweep(Task(chores.square), JOBS, engine, store, batch_size=3, together=lambda job: job["kind"])
    assert [row["square"] for row in result.rows if row is not None] == WANTED
    assert (result.resumed, result.run, result.interrupted) == (0, 20, False)
    assert len((tmp_path / "r.jsonl").read_text().splitlines()) == 20


def test_what_is_done_is_not_done_again(tmp_path: Path, chores: ModuleType) -> None:
    task = Task(chores.square, str(tmp_path / "log"))
    paces: list[Pace] = []
    with ResultStore(tmp_path / "r.jsonl") as store:
        run_sweep(task, JOBS[:12], Inline(), store)
        result = run_sweep(task, [*JOBS, JOBS[0]], Inline(), store, progress=paces.append)
        assert (result.resumed, result.run) == (12, 8)
        assert [row["square"] for row in result.rows if row is not None] == [*WANTED, 0]
        other = run_sweep(task, JOBS[:1], Inline(), store, basis="other data")
        assert (other.resumed, other.run) == (0, 1)
    assert sorted((tmp_path / "log").read_text().split(), key=int) == sorted(
        ["0", *(str(job["n"]) for job in JOBS)], key=int
    )
    assert [(pace.done, pace.total) for pace in (paces[0], paces[-1])] == [(12, 20), (20, 20)]
    assert paces[0].eta_s is None
    assert paces[-1].eta_s == 0.0


def test_a_worker_that_dies_is_replaced(tmp_path: Path, chores: ModuleType) -> None:
    with ResultStore(tmp_path / "r.jsonl") as store:
        result = run_sweep(Task(chores.die_once, str(tmp_path)), JOBS, Processes(2), store)
    assert (tmp_path / "died").exists()
    assert [row["square"] for row in result.rows if row is not None] == WANTED
    assert len((tmp_path / "r.jsonl").read_text().splitlines()) == 20


def test_a_job_that_kills_every_worker_ends_the_sweep(tmp_path: Path, chores: ModuleType) -> None:
    with ResultStore(tmp_path / "r.jsonl") as store, pytest.raises(TiegoCancelError, match="died 4 times"):
        run_sweep(Task(chores.die_always), JOBS[:1], Processes(1), store)


@pytest.mark.parametrize("engine", [Inline(), Processes(2)], ids=["inline", "processes"])
def test_a_failure_keeps_what_was_done(tmp_path: Path, chores: ModuleType, engine: Engine) -> None:
    with ResultStore(tmp_path / "r.jsonl") as store:
        with pytest.raises(ValueError, match="cannot be done"):
            run_sweep(Task(chores.fail), JOBS, engine, store)
        assert 0 < len(store.rows) <= 5


def test_a_task_that_returns_too_few_rows_is_refused(tmp_path: Path, chores: ModuleType) -> None:
    with ResultStore(tmp_path / "r.jsonl") as store, pytest.raises(ValueError, match="0 for 2"):
        run_sweep(Task(chores.too_few), JOBS, Inline(), store, batch_size=2)


def test_ctrl_c_keeps_what_was_done_and_says_so(tmp_path: Path, chores: ModuleType) -> None:
    def interrupt(pace: Pace) -> None:
        if pace.done == 6:
            os.kill(os.getpid(), signal.SIGINT)

    with ResultStore(tmp_path / "r.jsonl") as store:
        result = run_sweep(Task(chores.square), JOBS, Inline(), store, progress=interrupt)
        assert result.interrupted
        assert [row is not None for row in result.rows] == [True] * 6 + [False] * 14
        assert not run_sweep(Task(chores.square), JOBS, Inline(), store).interrupted


def test_a_killed_sweep_goes_on_where_it_was(tmp_path: Path, chores: ModuleType) -> None:
    """Kill the whole program, twice, at any moment; then finish, and count the rows."""
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]); import chores; from pathlib import Path\n"
        "from tiegocancel.study.sweep import *\n"
        "store = ResultStore(Path(sys.argv[2]))\n"
        "jobs = [{'n': n, 'kind': 'odd' if n % 2 else 'even'} for n in range(20)]\n"
        "run_sweep(Task(chores.slow_square, sys.argv[3]), jobs, Inline(), store, batch_size=2)\n"
    )
    results, log = tmp_path / "r.jsonl", tmp_path / "log"
    command = [sys.executable, "-c", program, str(HERE), str(results), str(log)]
    for lines in (4, 10):
        process = subprocess.Popen(command)
        _wait_until(lambda lines=lines: results.exists() and results.read_bytes().count(b"\n") >= lines)
        process.kill()
        process.wait()
    subprocess.run(command, check=True)
    with ResultStore(results) as store:
        done = run_sweep(Task(chores.square), JOBS, Inline(), store)
    assert done.run == 0
    assert [row["square"] for row in done.rows if row is not None] == WANTED
    assert len(results.read_text().splitlines()) == 20
    # A kill costs at most the batch that was under way.
    assert 20 <= len(log.read_text().split()) <= 24


def test_the_workers_of_a_killed_sweep_end(tmp_path: Path, chores: ModuleType) -> None:
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]); import chores; from pathlib import Path\n"
        "from tiegocancel.study.sweep import *\n"
        "if __name__ == '__main__':\n"
        "    jobs = [{'n': n} for n in range(2000)]\n"
        "    store = ResultStore(Path(sys.argv[2]))\n"
        "    run_sweep(Task(chores.slow_square, None), jobs, Processes(2), store)\n"
    )
    script, results = tmp_path / "sweep.py", tmp_path / "r.jsonl"
    script.write_text(program, encoding="utf-8")
    process = subprocess.Popen([sys.executable, str(script), str(HERE), str(results)])
    _wait_until(lambda: results.exists() and results.read_bytes().count(b"\n") >= 6)
    process.kill()
    process.wait()
    with ResultStore(results) as store:
        workers = {row["worker"] for row in store.rows.values()}
    assert len(workers) == 2
    _wait_until(lambda: not any(_runs(worker) for worker in workers))


def test_the_table_holds_every_row_once(tmp_path: Path, chores: ModuleType) -> None:
    with ResultStore(tmp_path / "r.jsonl") as store:
        result = run_sweep(Task(chores.square), JOBS, Inline(), store)
    rows = [None if row is None else row | {"profile": [1, 2]} for row in result.rows]
    files = write_table(tmp_path, "table", [*JOBS, {"n": 99}], [*rows, None])
    with files[0].open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert [int(line["square"]) for line in lines] == WANTED
    assert "profile" not in lines[0]
    if len(files) > 1:
        parquet = pytest.importorskip("pyarrow.parquet")
        table = parquet.read_table(files[1])
        assert table.column("n").to_pylist() == [job["n"] for job in JOBS]
        assert table.column("profile").to_pylist() == [[1, 2]] * 20


def _runs(pid: int) -> bool:
    """Tell whether a process runs; one that is dead and not yet collected does not."""
    try:
        os.kill(pid, 0)
        state = Path(f"/proc/{pid}/stat")
        return not state.exists() or state.read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False


def _wait_until(condition: Callable[[], bool]) -> None:
    limit = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < limit
        time.sleep(0.005)
