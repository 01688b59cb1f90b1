"""Atomic writing of a run's page, when the run ends or when an FMU fails in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path

from ..errors import TautwireError
from ..master import RunStatistics
from ..output import atomic_file
from ..recordings.recording import read_recording
from ..robots.robot import Robot
from ..runs.result_file import Column
from .overview import RunOverview
from .run import ReportedRun
from .run_page import run_page

MIN_ROWS = 2


@contextmanager
def atomic_run_page(
    target: Path | None,
    robot: Robot,
    columns: Sequence[Column],
    overview: RunOverview,
    recording_file: Path,
    links: Mapping[str, str],
) -> Iterator[Callable[[RunStatistics, Sequence[str]], None]]:
    """Context manager that writes a run's page to ``target`` when the block ends; without a ``target`` writes nothing.

    It yields a function to call with the statistics and notes of a completed run. Where the block fails with a
    TautwireError, the page shows the run until then and the error is raised again.

    Raises InputError where ``target`` cannot be written.
    """
    outcomes: list[tuple[RunStatistics, Sequence[str]]] = []
    failure: TautwireError | None = None
    with nullcontext() if target is None else atomic_file(target) as scratch:
        try:
            yield lambda account, notes: outcomes.append((account, notes))
        except TautwireError as error:
            if overview.row_count < MIN_ROWS:
                raise
            failure = error
        if scratch is not None:
            statistics, notes = outcomes[0] if outcomes else (None, ())
            names = tuple(column.name for column in columns[1:])
            recording, failure_text = (
                read_recording(recording_file, robot.cable_count),
                None if failure is None else str(failure),
            )
            run = ReportedRun(robot, names, overview, recording, statistics, tuple(notes), failure_text)
            scratch.write_text(run_page(run, links), encoding="utf-8")
    if failure is not None:
        raise failure
