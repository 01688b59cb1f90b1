"""A co-simulated run as one HTML page that needs no network, written when the run ends or when an FMU fails in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..atomic_output import atomic_file
from ..cosimulation import RunStatistics
from ..cosimulation.result_file import Column
from ..errors import TautwireError
from ..number_format import format_engineering, format_on_page, format_significant
from ..provenance import Provenance
from ..recordings.recording import read_recording
from ..robot.schema import AXES, Robot
from .page_rendering import Number, PageHeader, Row, render_page
from .run_figures import OutputSeries, output_series, run_data
from .run_overview import ReportedRun, RunOverview


@dataclass(frozen=True)
class QuantityView:
    """The outputs of one quantity: their panels, by channel index and label, and their rows in the table of extremes.

    A row ends with the difference from the recording where ``has_recorded`` is True.
    """

    title: str
    panels: Sequence[tuple[int, str]]
    rows: Sequence[Row]
    has_recorded: bool


@dataclass(frozen=True)
class PageFile:
    """Where a page is written, with its ``links`` and its ``provenance``."""

    path: Path
    links: Mapping[str, str] = field(default_factory=dict)
    provenance: Provenance | None = None


def run_page(run: ReportedRun, links: Mapping[str, str], provenance: Provenance | None = None) -> str:
    """The page of a run; ``links`` maps labels to paths beside the page, such as "result.csv"."""
    lines, headline = output_series(run), _run_sentence(run)
    title, subject = f"{run.robot.name}: {headline}", f"{run.robot.name}, {run.robot.cable_count} cables"
    header = PageHeader("Tautwire run", subject, headline, title, *_verdict(run), links, provenance)
    statistics = None if run.statistics is None else _statistics_texts(run.statistics)
    quantities = _quantities(lines)
    return render_page(
        "run", header, run_data(run, lines), run=run, statistics=statistics, quantities=quantities, notes=run.notes
    )


def _statistics_texts(statistics: RunStatistics) -> dict[str, str]:
    error = statistics.estimated_error
    return {
        "steps": str(statistics.steps),
        "iterations": str(statistics.iterations),
        "energy_exchanged": format_engineering(statistics.energy_exchanged, "J"),
        "energy_residual": format_engineering(statistics.energy_residual, "J"),
        "path_error": "" if error is None else format_on_page(error, "m"),
    }


def _verdict(run: ReportedRun) -> tuple[str, str]:
    """Whether the run was completed with all cables taut, and the CSS class of this verdict."""
    if run.failure is not None:
        return "Stopped: an FMU failed", "unexplained"
    slack = run.slack_cables()
    if slack:
        return f"Slack at times: {', '.join(f'cable {cable}' for cable in slack)}", "unexplained"
    return "Complete", "none"


def _run_sentence(run: ReportedRun) -> str:
    """The run in one sentence: duration, path length, range of tensions."""
    overview = run.overview
    duration = overview.last_time - float(overview.time[0])
    low, high = overview.extremes()
    sentence = f"{run.robot.name}: {format_significant(duration)} s"
    axes = list(run.column_indices("", AXES))
    if axes:
        path = overview.rows[:, axes]
        path_length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
        sentence += f" along {format_significant(path_length)} m"
    tensions = list(run.column_indices("tension_", run.robot.cable_numbers))
    if tensions:
        sentence += (
            f", under tensions of {format_significant(np.nanmin(low[tensions]))} to "
            f"{format_significant(np.nanmax(high[tensions]))} N"
        )
    return f"{sentence}."


def _quantities(lines: Sequence[OutputSeries]) -> list[QuantityView]:
    """The outputs of each quantity, with the rms difference only where something of the quantity was recorded."""
    views = []
    for title in dict.fromkeys(line.title for line in lines):
        channels = [(index, line) for index, line in enumerate(lines) if line.title == title]
        has_recorded = any(line.recorded is not None for _, line in channels)
        rows: list[Row] = [
            [
                line.label,
                *(_value_cell(line, end) for end in line.ends),
                *([_rms_cell(line)] if has_recorded else []),
            ]
            for _, line in channels
        ]
        views.append(QuantityView(title, [(index, line.label) for index, line in channels], rows, has_recorded))
    return views


def _rms_cell(line: OutputSeries) -> Number:
    unit, unit_size = line.difference_unit
    return Number(format_significant(line.rms_difference / unit_size), unit)


def _value_cell(line: OutputSeries, value: float) -> Number:
    return Number(format_significant(line.scale * value, line.digits), line.unit)


MIN_ROWS = 2


@contextmanager
def atomic_run_page(
    target: PageFile | None,
    robot: Robot,
    columns: Sequence[Column],
    overview: RunOverview,
    recording_file: Path,
) -> Iterator[Callable[[RunStatistics, Sequence[str]], None]]:
    """Context manager that writes a run's page to ``target`` when the block ends; without a ``target`` writes nothing.

    It yields a function to call with the statistics and notes of a completed run. Where the block fails with a
    TautwireError, the page shows the run until then and the error is raised again.

    Raises InputError where ``target`` cannot be written.
    """
    outcomes: list[tuple[RunStatistics, Sequence[str]]] = []
    failure: TautwireError | None = None
    with nullcontext() if target is None else atomic_file(target.path) as scratch:
        try:
            yield lambda statistics, notes: outcomes.append((statistics, notes))
        except TautwireError as error:
            if overview.row_count < MIN_ROWS:
                raise
            failure = error
        if scratch is not None and target is not None:
            recording = read_recording(recording_file, robot.cable_count, robot.recorded_columns)
            statistics, notes = outcomes[0] if outcomes else (None, recording.notes)
            names = tuple(column.name for column in columns[1:])
            failure_text = None if failure is None else str(failure)
            run = ReportedRun(robot, names, overview, recording, statistics, tuple(notes), failure_text)
            scratch.write_text(run_page(run, target.links, target.provenance), encoding="utf-8")
    if failure is not None:
        raise failure
