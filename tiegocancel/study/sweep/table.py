"""Write the results of a sweep as one table."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tiegocancel.study.sweep.job import Job, Row

__all__ = ["write_table"]


def write_table(folder: Path, name: str, jobs: Sequence[Job], rows: Sequence[Row | None]) -> list[Path]:
    """Write ``name.csv``, and ``name.parquet`` where pyarrow is installed; return the files.

    A line for each job that has a row: the job's columns, then the row's, in the order in which they first come.
    Profiles and histograms (lists) stand in the Parquet file alone.
    """
    lines = [{**dict(job), **row} for job, row in zip(jobs, rows, strict=True) if row is not None]
    names = list(dict.fromkeys(column for line in lines for column in line))
    written = [folder / f"{name}.csv"]
    plain = [column for column in names if not any(isinstance(line.get(column), list | dict) for line in lines)]
    with written[0].open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(plain)
        writer.writerows([line.get(column) for column in plain] for line in lines)
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        return written
    columns: dict[str, list[Any]] = {column: [line.get(column) for line in lines] for column in names}
    written.append(folder / f"{name}.parquet")
    pq.write_table(pa.table(columns), written[-1])
    return written
