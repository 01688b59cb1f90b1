"""A campaign from its plan to its rows: what is done stays done, and what is missing is made."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..recordings.recording import Recording, read_recording
from ..robots.reading import robot_from
from .cluster import SchedulerLostError, Task, results, shared_future
from .dataset import Parts, done_rows
from .errors import UnfinishedError
from .plan import Plan
from .rows import columns_of
from .run import Job, Result, reason_of
from .sampling import samples

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

# Runs that a task holds: those without motion take a few ms, and a task costs one.
TOGETHER_STATICS, TOGETHER_MODES = 200, 20
# Rows wait for at most so long (s), or for this share of the time gone: a long campaign has few parts.
LONGEST_WAIT, WAIT_SHARE = 1.0, 0.02
MOST_WAITING = 5000
# Errors of the disk that no other worker would be spared.
FULL = (errno.ENOSPC, errno.EDQUOT)


def run_count(plan: Plan) -> int:
    """How many runs, and so rows, a plan makes."""
    return len(plan.trace.recordings) if plan.trace else plan.count * len(plan.variants)


def jobs_of(plan: Plan, wanted: NDArray[np.bool_]) -> Iterator[Job]:
    """The runs that are wanted (N,), by ascending index: all variants of a sample, then those of the next."""
    if plan.trace is not None:
        yield from (Job(int(index), int(index), 0) for index in np.flatnonzero(wanted))
        return
    values, variants = samples(plan), len(plan.variants)
    for index in np.flatnonzero(wanted):
        sample, variant = divmod(int(index), variants)
        given = zip(plan.inputs, values[sample].tolist(), strict=True)
        yield Job(int(index), sample, variant, tuple(each.distribution.value(number) for each, number in given))


def tasks_of(plan: Plan, wanted: NDArray[np.bool_], cable_count: int) -> Iterator[Task]:
    """The wanted runs as tasks; a recording is read when its turn comes, and goes with its task."""
    jobs = jobs_of(plan, wanted)
    if plan.trace is not None:
        yield from (_traced(plan.trace.recordings[job.index], job, cable_count) for job in jobs)
        return
    together = 1 if plan.paths else TOGETHER_MODES if plan.compute.modes else TOGETHER_STATICS
    while some := tuple(islice(jobs, together)):
        yield Task(some)


def _traced(file: str, job: Job, cable_count: int) -> Task:
    name = Path(file).name
    try:
        return Task((job,), read_recording(file, cable_count), name)
    except InputError as error:
        return Task((job,), None, name, reason_of(error))


def recordings_of(plan: Plan, cable_count: int) -> dict[str, Recording]:
    """The recordings of winch speeds that paths name, by their paths' names."""
    return {path.name: read_recording(path.recording, cable_count) for path in plan.paths if path.recording}


def make_rows(plan: Plan, folder: Path, client: Any, tell: Progress) -> int:
    """Make the rows that are missing in a folder with a Dask client, and return how many these were.

    The folder is one that :func:`tautwire.campaign.dataset.opened` holds.

    Raises UnfinishedError where it is interrupted, the scheduler is lost or a disk is full: what came until then is
    written. Raises what :func:`tautwire.campaign.run.shared_of` raises.
    """
    count = run_count(plan)
    cable_count = robot_from(dict(plan.content), plan.file).cable_count
    done = done_rows(folder, count)
    if done.all():
        return 0
    try:
        with Parts(folder, columns_of(plan, cable_count)) as parts:
            tell("preparing", 0.0)
            shared = shared_future(client, plan, recordings_of(plan, cable_count))
            tasks = tasks_of(plan, ~done, cable_count)
            _keep(results(client, shared, plan, tasks), parts, int(done.sum()), count, tell)
    except KeyboardInterrupt as error:
        raise UnfinishedError("interrupted", _written(folder, count), count) from error
    except SchedulerLostError as error:
        raise UnfinishedError(str(error), _written(folder, count), count) from error
    except OSError as error:
        reason = "the disk is full" if error.errno in FULL else f"stopped ({error})"
        raise UnfinishedError(reason, _written(folder, count), count) from error
    return count - int(done.sum())


def _keep(found: Iterator[list[Result]], parts: Parts, made: int, count: int, tell: Progress) -> None:
    """Let rows go to disk as they come, some at a time."""
    begun = written = monotonic()
    tell("running", made / count)
    for some in found:
        parts.add(some)
        made += len(some)
        wait = max(LONGEST_WAIT, WAIT_SHARE * (monotonic() - begun))
        if parts.waiting >= MOST_WAITING or monotonic() - written > wait:
            parts.flush()
            written = monotonic()
        tell("running", made / count)


def _written(folder: Path, count: int) -> int:
    return int(done_rows(folder, count).sum())
