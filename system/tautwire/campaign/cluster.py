"""Dask, by its documented ways: a cluster of this machine's processors, or the user's by its address."""

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
from .errors import MissingExtraError
from .plan import Plan
from .rows import FAILURE
from .run import Job, Result, Shared, run_job, shared_of

CONNECT = 15.0  # s
# Tasks in flight for each thread: enough that none waits, few enough that memory stays flat.
AHEAD = 4
LOOK_AGAIN = 2.0  # s
# A profiler and checks up to a hundred times a second would take some per cent of what runs take; the scheduler's
# memory of tasks grows with what these hold.
FRUGAL = {
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "2s",
    "distributed.admin.low-level-log-length": 20,
}
LOST = "its worker was lost again and again: out of memory, or an FMU ended its process"


class SchedulerLostError(TautwireError):
    """Dask's scheduler is gone."""


@dataclass(frozen=True)
class Task:
    """What goes to a worker at once: some runs, or a recording to be traced, or the ``problem`` that it is unreadable.

    ``name`` is that of the recording.
    """

    jobs: tuple[Job, ...]
    recording: Any = None
    name: str = ""
    problem: str = ""


@contextmanager
def connected(scheduler: str | None, workers: int) -> Iterator[Any]:
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
            mend = "give the address that the scheduler printed, such as tcp://127.0.0.1:8786"
            raise InputError("--scheduler", f"no Dask scheduler answers at {scheduler}", mend) from error
        with client:
            yield client
        return
    with config.set(FRUGAL):
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


def dashboard(client: Any) -> str:
    """What to say of the dashboard: its address, or that there is none."""
    if client.cluster is not None and find_spec("bokeh") is None:
        return "Dask's dashboard is off: it needs bokeh"
    return f"Dask's dashboard: {client.dashboard_link}"


def work(shared: Shared, task: Task) -> list[Result]:
    """What a worker does with a task."""
    from distributed import get_worker

    folder = Path(get_worker().local_directory) / "tautwire-fmus"
    return done_here(shared, task, folder)


def done_here(shared: Shared, task: Task, folder: Path) -> list[Result]:
    """A task in this process; ``folder`` keeps FMUs from run to run."""
    if shared.plan.trace is None:
        return [run_job(shared, job, folder) for job in task.jobs]
    if task.problem:
        return [failed(shared.plan, task, job, task.problem) for job in task.jobs]
    from .traced import traced_row

    return [Result(traced_row(shared.plan, job.index, task.recording)) for job in task.jobs]


def failed(plan: Plan, task: Task, job: Job, reason: str) -> Result:
    """The row of a run that came to nothing."""
    if plan.trace is not None:
        return Result({"index": job.index, "recording": task.name, FAILURE: reason})
    place, controller = plan.variants[job.variant]
    path = {"path": plan.paths[place].name, "controller": controller} if place >= 0 else {}
    inputs = dict(zip(plan.keys, job.values, strict=True))
    return Result({"index": job.index, "sample": job.sample, **path, **inputs, FAILURE: reason})


def results(client: Any, shared: Any, plan: Plan, tasks: Iterable[Task]) -> Iterator[list[Result]]:
    """The results of tasks as they come; no more tasks are in flight than keep all workers busy.

    ``shared`` is a future. A task whose worker is lost goes to another one, as often as Dask's ``allowed-failures``
    says; then its runs go alone, and the one at which workers are lost is a row that says so.

    Raises OSError where a worker's machine fails, SchedulerLostError where the scheduler is gone.
    """
    from distributed import KilledWorker

    flight = _Flight(client, shared, tasks)
    with _scheduler_lost(client):
        flight.fill()
    while flight.running:
        with _scheduler_lost(client):
            task, future = flight.landed()
            found = future.result() if future.status == "finished" else None
            error = future.exception() if found is None else None
        if found is not None:
            yield found
        elif isinstance(error, OSError):
            raise error
        elif isinstance(error, KilledWorker) and len(task.jobs) > 1:
            for job in task.jobs:
                flight.submit(Task((job,)))
        else:
            reason = LOST if isinstance(error, KilledWorker) else f"{type(error).__name__}: {error}"
            yield [failed(plan, task, job, reason) for job in task.jobs]
        with _scheduler_lost(client):
            future.release()
            flight.fill()


@contextmanager
def _scheduler_lost(client: Any) -> Iterator[None]:
    """Tell in the campaign's own words that the scheduler is gone, whatever Dask calls it where it is found out."""
    from distributed.client import FutureCancelledError
    from distributed.comm import CommClosedError

    try:
        yield
    except Exception as error:
        if isinstance(error, CommClosedError | FutureCancelledError) or client.status != "running":
            raise SchedulerLostError("Dask's scheduler was lost") from error
        raise


class _Flight:
    """Tasks that workers have: no more than there is room for, each until it :meth:`landed`."""

    def __init__(self, client: Any, shared: Any, tasks: Iterable[Task]) -> None:
        from distributed import as_completed

        self.running: dict[str, Task] = {}
        self._client = client
        self._shared = shared
        self._waiting = iter(tasks)
        self._completed = as_completed(loop=client.loop)
        self._room = _Room(client)

    def submit(self, task: Task) -> None:
        """Send a task to a worker."""
        future = self._client.submit(work, self._shared, task, pure=False)
        self.running[future.key] = task
        self._completed.add(future)

    def fill(self) -> None:
        """Send tasks that wait for as long as there is room."""
        while len(self.running) < self._room.size():
            task = next(self._waiting, None)
            if task is None:
                return
            self.submit(task)

    def landed(self) -> tuple[Task, Any]:
        """Wait for the next task that comes back, with its future."""
        future = next(self._completed)
        return self.running.pop(future.key), future


class _Room:
    """How many tasks may be in flight; asks anew now and then, for workers come and go."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._asked = -LOOK_AGAIN
        self._size = AHEAD

    def size(self) -> int:
        if time.monotonic() - self._asked > LOOK_AGAIN:
            self._size = AHEAD * max(1, sum(self._client.nthreads().values()))
            self._asked = time.monotonic()
        return self._size


def shared_future(client: Any, plan: Plan, recordings: Any) -> Any:
    """What all runs share, made in a worker, from which Dask takes it to each other one once.

    Where its holders are lost Dask makes it again. Raises what making it raises.
    """
    future = client.submit(shared_of, plan, recordings, pure=False)
    error = future.exception()
    if isinstance(error, ImportError):
        mend = "install the same version of tautwire with its extra campaign where the workers run"
        raise InputError("--scheduler", f"its workers cannot import what they need ({error})", mend) from error
    if error is not None:
        raise error
    return future
