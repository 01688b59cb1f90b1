"""Dask's scheduler and workers as processes of their own, and the rows that come of them."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from distributed import Client

from tautwire.campaigns.campaign_dataset import read_rows
from tautwire.campaigns.campaign_plan import Plan
from tautwire.campaigns.dataset_schema import row_columns
from tests.support.campaigns import bare_results

Processes = list[subprocess.Popen[bytes]]

DASK = (sys.executable, "-m", "dask")


def rows_of(folder: Path) -> list[dict[str, object]]:
    """All rows; refuses a run with two."""
    rows: list[dict[str, object]] = read_rows(folder).to_pylist()
    assert [row["index"] for row in rows] == list(range(len(rows)))
    return rows


def bare_rows(plan: Plan, folder: Path) -> list[dict[str, object]]:
    """What a bare loop makes of it, with a null wherever a run says nothing."""
    names = [column.name for column in row_columns(plan, 3)]
    return [{**dict.fromkeys(names), **result.row} for result in bare_results(plan, folder)]


@contextmanager
def cluster(folder: Path, workers: int = 2, dashboard: bool = False) -> Iterator[tuple[str, Processes]]:
    """The address of a scheduler on loopback; it and its workers, each a process as Dask's commands start them."""
    file = folder / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    common = ["--scheduler-file", str(file)]
    shown = ["--dashboard-address", "127.0.0.1:0"] if dashboard else ["--no-dashboard"]
    scheduler = [*DASK, "scheduler", "--host", "127.0.0.1", "--port", "0", *common, *shown]
    place = ["--local-directory", str(folder / "local")]
    worker = [*DASK, "worker", "--nthreads", "1", "--no-nanny", "--no-dashboard", *place, *common]
    processes = [subprocess.Popen(scheduler, **quiet)]  # type: ignore[call-overload]
    try:
        wait_for(file.exists)
        processes += [subprocess.Popen(worker, **quiet) for _ in range(workers)]  # type: ignore[call-overload]
        with Client(scheduler_file=str(file), set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=300)
            address = client.scheduler.address
        yield address, processes
    finally:
        for process in processes:
            process.kill()
            process.wait()


def wait_for(holds: Callable[[], bool], seconds: float = 300.0) -> None:
    """Waits until something holds."""
    until = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < until
        time.sleep(0.05)
