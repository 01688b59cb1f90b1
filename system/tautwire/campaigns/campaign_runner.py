"""Runs a campaign from its plan to its rows, resuming where it stopped, and writes its summary and page."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..atomic_output import atomic_folder
from ..errors import InputError
from ..provenance import Provenance
from ..recordings.recording import Recording, read_recording
from ..robot.robot_file_reader import robot_from_content
from ..robot.schema import Robot
from .campaign_dataset import PartWriter, completed_runs, read_rows
from .campaign_figures import CampaignResults
from .campaign_page import campaign_page, trace_summary_page
from .campaign_plan import MissingExtraError, Plan, UnfinishedError
from .campaign_run import Job, RunResult, failure_reason
from .campaign_summary import summarise_runs
from .dask_cluster import SchedulerLostError, Task, context_future, task_results
from .dataset_schema import row_columns
from .input_sampling import draw_samples
from .platform_rotations import with_end_rotations
from .trace_summary import summarise_traces

Array = NDArray[np.float64]
ProgressCallback = Callable[[str, float], None]

# Runs without motion take a few ms each, and a task has an overhead of one.
STATIC_RUNS_PER_TASK, MODAL_RUNS_PER_TASK = 200, 20
# Rows are flushed at the longer of this interval (s) and this fraction of the elapsed time: few parts in all.
MIN_FLUSH_INTERVAL, FLUSH_TIME_FRACTION = 1.0, 0.02
MAX_BUFFERED_ROWS = 5000
# Errors of the disk that would meet every other worker too.
DISK_FULL_ERRNOS = (errno.ENOSPC, errno.EDQUOT)

PAGE_LINKS = {"summary.json": "summary.json"}


def input_files(plan: Plan, plan_file: Path) -> dict[str, Path]:
    """The files that a campaign reads, by name: the plan; the robot file and recordings, relative to the plan.

    A recording that is not there is a failed run, and no input.
    """
    recordings = plan.trace.recordings if plan.trace else [path.recording for path in plan.paths if path.recording]
    files = [Path(file) for file in (plan.file, *recordings)]
    folder = plan_file.parent
    return {str(plan_file): plan_file} | {os.path.relpath(file, folder): file for file in files if file.is_file()}


def run_count(plan: Plan) -> int:
    """Number of runs, and so of rows, of a plan."""
    return len(plan.trace.recordings) if plan.trace else plan.count * len(plan.variants)


def planned_jobs(plan: Plan, selected: NDArray[np.bool_]) -> Iterator[Job]:
    """The selected runs, by a mask (N,), in ascending index: all variants of a sample, then those of the next."""
    if plan.trace is not None:
        yield from (Job(int(index), int(index), 0) for index in np.flatnonzero(selected))
        return
    values, variants = draw_samples(plan), len(plan.variants)
    for index in np.flatnonzero(selected):
        sample, variant = divmod(int(index), variants)
        numbers = zip(plan.inputs, values[sample].tolist(), strict=True)
        yield Job(int(index), sample, variant, tuple(each.distribution.value(number) for each, number in numbers))


def planned_tasks(plan: Plan, selected: NDArray[np.bool_], robot: Robot) -> Iterator[Task]:
    """The selected runs as tasks; a recording is read when its task is submitted, and sent with it."""
    jobs = planned_jobs(plan, selected)
    if plan.trace is not None:
        yield from (_trace_task(plan.trace.recordings[job.index], job, robot) for job in jobs)
        return
    runs_per_task = 1 if plan.paths else MODAL_RUNS_PER_TASK if plan.compute.modes else STATIC_RUNS_PER_TASK
    while batch := tuple(islice(jobs, runs_per_task)):
        yield Task(batch)


def _trace_task(file: str, job: Job, robot: Robot) -> Task:
    name = Path(file).name
    try:
        return Task((job,), read_recording(file, robot.cable_count, robot.recorded_columns), name)
    except InputError as error:
        return Task((job,), None, name, failure_reason(error))


def path_recordings(plan: Plan, robot: Robot) -> dict[str, Recording]:
    """The recordings of winch speeds that paths name, by path name."""
    return {
        path.name: read_recording(path.recording, robot.cable_count, robot.recorded_columns)
        for path in plan.paths
        if path.recording
    }


def run_campaign(
    plan: Plan, folder: Path, client: Any, report_progress: ProgressCallback, provenance: Provenance | None = None
) -> int:
    """Run the missing runs of a campaign with a Dask client, and return their number.

    The folder must be locked by :func:`tautwire.campaigns.campaign_dataset.open_dataset`.

    Raises UnfinishedError where it is interrupted, the scheduler is lost or a disk is full; rows completed before are
    written. Raises what :func:`tautwire.campaigns.campaign_run.build_context` raises.
    """
    count = run_count(plan)
    robot = robot_from_content(dict(plan.content), plan.file)
    completed = completed_runs(folder, count)
    if completed.all():
        return 0
    try:
        with PartWriter(folder, row_columns(plan, robot.cable_count), provenance) as writer:
            report_progress("preparing", 0.0)
            shared = context_future(client, plan, path_recordings(plan, robot))
            tasks = planned_tasks(plan, ~completed, robot)
            _write_results(
                task_results(client, shared, plan, tasks), writer, int(completed.sum()), count, report_progress
            )
    except KeyboardInterrupt as error:
        raise UnfinishedError("interrupted", _written_count(folder, count), count) from error
    except SchedulerLostError as error:
        raise UnfinishedError(str(error), _written_count(folder, count), count) from error
    except OSError as error:
        reason = "the disk is full" if error.errno in DISK_FULL_ERRNOS else f"stopped ({error})"
        raise UnfinishedError(reason, _written_count(folder, count), count) from error
    return count - int(completed.sum())


def _write_results(
    batches: Iterator[list[RunResult]],
    writer: PartWriter,
    completed_count: int,
    count: int,
    report_progress: ProgressCallback,
) -> None:
    """Write rows to disk as they are completed, in batches."""
    start_time = flush_time = monotonic()
    report_progress("running", completed_count / count)
    for batch in batches:
        writer.add(batch)
        completed_count += len(batch)
        flush_interval = max(MIN_FLUSH_INTERVAL, FLUSH_TIME_FRACTION * (monotonic() - start_time))
        if writer.buffered_count >= MAX_BUFFERED_ROWS or monotonic() - flush_time > flush_interval:
            writer.flush()
            flush_time = monotonic()
        report_progress("running", completed_count / count)


def _written_count(folder: Path, count: int) -> int:
    return int(completed_runs(folder, count).sum())


def require_libraries(plan: Plan) -> None:
    """Raises MissingExtraError where a library is not installed that the campaign will need."""
    for module, name in (("distributed", "dask[distributed]"), ("SALib", "SALib")):
        if find_spec(module) is None and (module != "SALib" or plan.inputs):
            raise MissingExtraError(name)


def write_summary(plan: Plan, folder: Path, provenance: Provenance | None = None) -> dict[str, Any]:
    """Write ``summary.json`` and ``index.html`` into a campaign's folder, and return the summary."""
    rows = read_rows(folder)
    if plan.trace is not None:
        traces = summarise_traces(rows)
        document, page = traces.document(), trace_summary_page(plan, traces, rows, PAGE_LINKS, provenance)
    else:
        robot = robot_from_content(dict(plan.content), plan.file)
        columns, rows = with_end_rotations(plan, row_columns(plan, robot.cable_count), rows)
        summary = summarise_runs(plan, columns, rows)
        results = CampaignResults(columns, rows, summary, folder)
        document, page = summary.document(), campaign_page(plan, robot, results, PAGE_LINKS, provenance)
    document |= {"provenance": provenance.document()} if provenance else {}
    with atomic_folder(folder) as scratch:
        (scratch / "summary.json").write_text(json.dumps(document, indent=1), encoding="utf-8")
        (scratch / "index.html").write_text(page, encoding="utf-8")
    return document
