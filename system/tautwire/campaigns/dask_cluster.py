"""Distributed execution by Dask, on a local cluster of processes or on a scheduler at an address."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..errors import InputError, TautwireError
from .campaign_plan import MissingExtraError, Plan
from .campaign_run import CampaignContext, Job, RunResult, build_context, identifying_columns, run_job
from .dataset_schema import FAILURE_COLUMN

CONNECT = 15.0  # s
# Tasks in flight per thread: enough to keep all busy, few enough that memory stays flat.
TASKS_PER_THREAD = 4
WORKER_COUNT_INTERVAL = 2.0  # s
# Dask's profiler and its checks, up to a hundred times a second, would cost some per cent of the run time;
# the scheduler's memory grows with its log of tasks.
LOW_OVERHEAD_CONFIG = {
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "2s",
    "distributed.admin.low-level-log-length": 20,
}
WORKER_LOST = "its worker was lost repeatedly: out of memory, or an FMU ended its process"


class SchedulerLostError(TautwireError):
    """Dask's scheduler is gone."""


@dataclass(frozen=True)
class Task:
    """A task for one worker: some runs, or a recording to trace, or the ``problem`` that makes it unreadable.

    ``name`` is the file name of the recording.
    """

    jobs: tuple[Job, ...]
    recording: Any = None
    name: str = ""
    problem: str = ""


@contextmanager
def dask_client(scheduler: str | None, workers: int) -> Iterator[Any]:
    """A Dask client: of the scheduler at an address, or of a local cluster of processes with one thread each.

    Raises MissingExtraError without Dask, InputError where no scheduler answers.
    """
    try:
        from dask import config
        from dask.distributed import Client, LocalCluster
    except ImportError as error:
        raise MissingExtraError("dask[distributed]") from error
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            hint = "give the address that the scheduler printed, such as tcp://127.0.0.1:8786"
            raise InputError("--scheduler", f"no Dask scheduler answers at {scheduler}", hint) from error
        with client:
            yield client
        return
    with config.set(LOW_OVERHEAD_CONFIG):
        cluster = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",
            preload=[f"{__package__}.worker_setup"],
            silence_logs=logging.CRITICAL,
        )
        with cluster, Client(cluster, timeout=CONNECT, set_as_default=False) as client:
            yield client


def dashboard_message(client: Any) -> str:
    """Message with the address of Dask's dashboard, or the reason why there is none."""
    if client.cluster is not None and find_spec("bokeh") is None:
        return "Dask's dashboard is off: it needs bokeh"
    return f"Dask's dashboard: {client.dashboard_link}"


def run_task_on_worker(context: CampaignContext, task: Task) -> list[RunResult]:
    """Run a task on a Dask worker, with the FMU cache in its local directory."""
    from distributed import get_worker

    fmu_folder = Path(get_worker().local_directory) / "tautwire-fmus"
    return run_task(context, task, fmu_folder)


def run_task(context: CampaignContext, task: Task, fmu_folder: Path) -> list[RunResult]:
    """Run a task in this process; ``fmu_folder`` caches FMUs between runs."""
    if context.plan.trace is None:
        return [run_job(context, job, fmu_folder) for job in task.jobs]
    if task.problem:
        return [failed_result(context.plan, task, job, task.problem) for job in task.jobs]
    from .trace_summary import trace_row

    return [RunResult(trace_row(context.plan, job.index, task.recording)) for job in task.jobs]


def failed_result(plan: Plan, task: Task, job: Job, reason: str) -> RunResult:
    """The row of a failed run, with the ``reason``."""
    if plan.trace is not None:
        return RunResult({"index": job.index, "recording": task.name, FAILURE_COLUMN: reason})
    return RunResult({**identifying_columns(plan, job), FAILURE_COLUMN: reason})


def task_results(client: Any, context: Any, plan: Plan, tasks: Iterable[Task]) -> Iterator[list[RunResult]]:
    """Yield the results of tasks as they complete; tasks in flight are limited to what keeps all workers busy.

    ``context`` is a future. A task whose worker is lost is rescheduled, as often as Dask's ``allowed-failures`` says;
    then its runs are submitted one by one, and the one at which workers are lost becomes a row with that reason.

    Raises OSError where a worker's machine fails, SchedulerLostError where the scheduler is gone.
    """
    from distributed import KilledWorker

    in_flight = _TasksInFlight(client, context, tasks)
    with _translate_scheduler_loss(client):
        in_flight.fill()
    while in_flight.running:
        with _translate_scheduler_loss(client):
            task, future = in_flight.next_completed()
            task_result = future.result() if future.status == "finished" else None
            error = future.exception() if task_result is None else None
        if task_result is not None:
            yield task_result
        elif isinstance(error, OSError):
            raise error
        elif isinstance(error, KilledWorker) and len(task.jobs) > 1:
            for job in task.jobs:
                in_flight.submit(Task((job,)))
        else:
            reason = WORKER_LOST if isinstance(error, KilledWorker) else f"{type(error).__name__}: {error}"
            yield [failed_result(plan, task, job, reason) for job in task.jobs]
        with _translate_scheduler_loss(client):
            future.release()
            in_flight.fill()


@contextmanager
def _translate_scheduler_loss(client: Any) -> Iterator[None]:
    """Translate whatever Dask raises when the scheduler is gone into SchedulerLostError."""
    from distributed.client import FutureCancelledError
    from distributed.comm import CommClosedError

    try:
        yield
    except Exception as error:
        if isinstance(error, CommClosedError | FutureCancelledError) or client.status != "running":
            raise SchedulerLostError("Dask's scheduler was lost") from error
        raise


class _TasksInFlight:
    """Tasks submitted to workers and not yet completed, limited by the capacity of the workers."""

    def __init__(self, client: Any, context: Any, tasks: Iterable[Task]) -> None:
        from distributed import as_completed

        self.running: dict[str, Task] = {}
        self._client = client
        self._context = context
        self._pending = iter(tasks)
        self._completed = as_completed(loop=client.loop)
        self._capacity = _WorkerCapacity(client)

    def submit(self, task: Task) -> None:
        """Submit a task to the cluster."""
        future = self._client.submit(run_task_on_worker, self._context, task, pure=False)
        self.running[future.key] = task
        self._completed.add(future)

    def fill(self) -> None:
        """Submit pending tasks while there is capacity."""
        while len(self.running) < self._capacity.task_limit():
            task = next(self._pending, None)
            if task is None:
                return
            self.submit(task)

    def next_completed(self) -> tuple[Task, Any]:
        """Wait for the next completed task, and return it with its future."""
        future = next(self._completed)
        return self.running.pop(future.key), future


class _WorkerCapacity:
    """Limit of tasks in flight; counts threads anew now and then, since workers come and go."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._counted_at = -WORKER_COUNT_INTERVAL
        self._task_limit = TASKS_PER_THREAD

    def task_limit(self) -> int:
        if time.monotonic() - self._counted_at > WORKER_COUNT_INTERVAL:
            self._task_limit = TASKS_PER_THREAD * max(1, sum(self._client.nthreads().values()))
            self._counted_at = time.monotonic()
        return self._task_limit


def context_future(client: Any, plan: Plan, recordings: Any) -> Any:
    """Future of the context that all runs share, built in a worker and copied by Dask once to each other worker.

    Where all workers that hold it are lost, Dask builds it again. Workers of another scheduler than this process's own
    may be other machines, where this one's machine code does not run. Raises what :func:`build_context` raises.
    """
    prefers_native = client.cluster is not None
    future = client.submit(build_context, plan, recordings, prefers_native, pure=False)
    error = future.exception()
    if isinstance(error, ImportError):
        hint = "install the same version of tautwire with its extra campaign where the workers run"
        raise InputError("--scheduler", f"its workers cannot import what they need ({error})", hint) from error
    if error is not None:
        raise error
    return future
