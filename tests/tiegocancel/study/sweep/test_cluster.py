"""A sweep on a real local cluster loses nothing when a worker is killed."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from types import ModuleType

import pytest

from tiegocancel.errors import ConfigError
from tiegocancel.study.sweep import Pace, ResultStore, Task, run_sweep
from tiegocancel.study.sweep.cluster import Cluster

distributed = pytest.importorskip("distributed", reason="the extra cluster is not installed")

HERE = Path(__file__).parent
JOBS = [{"n": number} for number in range(60)]


@pytest.fixture(scope="module")
def chores() -> ModuleType:
    """Import the jobs under a name that workers can import too."""
    sys.path.insert(0, str(HERE))
    os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")])
    import chores

    return chores


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_killed_worker_costs_no_row_and_doubles_none(tmp_path: Path, chores: ModuleType) -> None:
    killed: list[int] = []
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
        ResultStore(tmp_path / "r.jsonl") as store,
    ):
        pids = list(client.run(os.getpid).values())
        assert len(set(pids)) == 2

        def kill_one(pace: Pace) -> None:
            if pace.done >= 10 and not killed:
                killed.append(pids[0])
                os.kill(pids[0], signal.SIGKILL)

        result = run_sweep(Task(chores.slow_square), JOBS, Cluster(client=client), store, progress=kill_one)
        assert killed
        workers = {row["worker"] for row in result.rows if row is not None}
        assert os.getpid() not in workers
        assert len(workers) >= 2
    assert [row["square"] for row in result.rows if row is not None] == [job["n"] ** 2 for job in JOBS]
    assert len((tmp_path / "r.jsonl").read_text().splitlines()) == len(JOBS)


def test_an_address_where_nobody_listens_is_one_line(tmp_path: Path, chores: ModuleType) -> None:
    with ResultStore(tmp_path / "r.jsonl") as store, pytest.raises(ConfigError, match="no scheduler"):
        run_sweep(Task(chores.square), JOBS, Cluster("not-an-address"), store)


def test_a_cluster_needs_one_way_to_reach_it() -> None:
    with pytest.raises(ValueError, match="address or by its client"):
        Cluster()
