"""A co-simulated run as one HTML page that needs no network, written when the run ends or when an FMU fails in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path

import numpy as np

from ..atomic_output import atomic_file
from ..cosimulation import RunStatistics
from ..cosimulation.result_file import Column
from ..cosimulation.robot_wiring import AXES
from ..errors import TautwireError
from ..number_format import format_engineering, format_significant
from ..recordings.recording import read_recording
from ..robot.schema import Robot
from .html_markup import (
    TableColumn,
    bullet_list,
    download_links,
    escape_text,
    html_page,
    number_html,
    panel_groups,
    section,
    table,
)
from .robot_scene import figures_container, legend_key, scene_section
from .run_figures import OutputSeries, output_series, run_data
from .run_overview import ReportedRun, RunOverview


def run_page(run: ReportedRun, links: Mapping[str, str]) -> str:
    """The page of a run; ``links`` maps labels to paths beside the page, such as "result.csv"."""
    lines = output_series(run)
    figures = _scene_section(run) + _outputs_section(run, lines)
    parts = [_masthead(run, links), figures_container("", figures), _extremes_section(run, lines), _notes_section(run)]
    title = f"{run.robot.name}: {_run_sentence(run)}"
    return html_page(title, "\n".join(parts), run_data(run, lines), ("run.js",))


def _masthead(run: ReportedRun, links: Mapping[str, str]) -> str:
    verdict, css_class = _verdict(run)
    statistics = run.statistics
    statistics_text = "" if statistics is None else (
        f"{statistics.steps} steps of the master, and {statistics.iterations} repeats of steps until the FMUs "
        "agreed at their ends. "
        f"Of the {format_engineering(statistics.energy_exchanged, 'J')} that the FMUs exchanged, "
        f"{format_engineering(statistics.energy_residual, 'J')} came from "
        "the coupling."
    )  # fmt: skip
    if statistics is not None and statistics.estimated_error is not None:
        statistics_text += f" Estimated error of the path: {format_engineering(statistics.estimated_error, 'm')}."
    return (
        f'<header><p class="eyebrow"><strong>Tautwire run</strong> '
        f"<span>{escape_text(run.robot.name)}, {run.robot.cable_count} cables</span></p>"
        f'<p class="verdict verdict-{css_class}">{escape_text(verdict)}</p><h1>{escape_text(_run_sentence(run))}</h1>'
        f'<p class="aside">{number_html(run.failure or statistics_text)}</p>{download_links(links)}</header>'
    )


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


def _extremes_section(run: ReportedRun, lines: Sequence[OutputSeries]) -> str:
    """First, last, minimum and maximum value of each output, and its rms difference from the recording."""
    titles = list(dict.fromkeys(line.title for line in lines))
    content = "".join(_quantity_table(run, title, [line for line in lines if line.title == title]) for title in titles)
    lead = "Apart: root mean square (rms) of recorded minus co-simulated."
    return section("summary", "In figures", content, lead)


def _quantity_table(run: ReportedRun, title: str, lines: Sequence[OutputSeries]) -> str:
    """The table of one quantity; the last column only where something of it was recorded."""
    low, high = run.overview.extremes()
    ends = (run.overview.rows[0], run.overview.last_row, low, high)
    columns = [
        TableColumn("Output"),
        *(TableColumn(name, True) for name in ("At the start", "At the end", "Least", "Largest")),
    ]
    rows = [[escape_text(line.label), *(_value_cell(line, end[line.column_index]) for end in ends)] for line in lines]
    if any(line.recorded is not None for line in lines):
        columns.append(TableColumn("Apart, rms", True))
        rows = [[*row, _rms_cell(line)] for row, line in zip(rows, lines, strict=True)]
    return table(title, columns, rows, "extremes")


def _rms_cell(line: OutputSeries) -> str:
    unit, unit_size = line.difference_unit
    return (
        number_html("-")
        if math.isnan(line.rms_difference)
        else f"{number_html(format_significant(line.rms_difference / unit_size))} {escape_text(unit)}"
    )


def _value_cell(line: OutputSeries, value: float) -> str:
    if not np.isfinite(value):
        return number_html("-")
    return (
        f"{number_html(format_significant(line.scale * float(value), 4))} <span "
        f'class="unit">{escape_text(line.unit)}</span>'
    )


def _scene_section(run: ReportedRun) -> str:
    """The robot in space with its controls."""
    label = (
        f"The robot in space: {run.robot.cable_count} cables from their exit points to the platform, coloured by "
        "tension, and its path."
    )
    recorded = run.recording.has_position
    keys = legend_key("after", "co-simulated") + (legend_key("recorded-path", "recorded") if recorded else "")
    lead = "Cables are coloured by their tension."
    if recorded:
        lead += " What was recorded is drawn farther from the path than it is, by the factor chosen below the picture."
    return scene_section("The robot in motion", lead, label, keys, magnified=recorded)


def _outputs_section(run: ReportedRun, lines: Sequence[OutputSeries]) -> str:
    """A panel for each output over time."""
    keys = legend_key("after", "co-simulated")
    lead = "What the FMUs showed over time"
    if any(line.recorded is not None for line in lines):
        keys += legend_key("recorded") + legend_key("difference", "recorded minus co-simulated")
        lead += "; behind it, as a broader line, what was recorded, and below it the difference of the two"
    groups: dict[str, list[tuple[int, str]]] = {}
    for place, line in enumerate(lines):
        groups.setdefault(line.title, []).append((place, line.label))
    compared = {line.title for line in lines if line.recorded is not None}
    panels = "".join(
        panel_groups("compared" if title in compared else "output", {title: group}, "Course over time")
        for title, group in groups.items()
    )
    return section("outputs", "Over time", f'<p class="keys">{keys}</p>{panels}', f"{lead}.")


def _notes_section(run: ReportedRun) -> str:
    lines = list(run.notes)
    if run.recording.unknown_columns:
        lines.append(f"Columns of the recording that were not read: {', '.join(run.recording.unknown_columns)}")
    return section("notes", "Notes", bullet_list(lines)) if lines else ""


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
