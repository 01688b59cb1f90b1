"""A co-simulated run as one HTML page that needs no network."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..runs.wiring import AXES
from .markup import Column, bullets, downloads, number, section, table, text
from .panels import panel_groups
from .run import Run
from .run_figures import Line, lines_of, run_data
from .scene import figures_body, key, scene_section
from .shell import html_page
from .units import engineering, significant


def run_page(run: Run, links: Mapping[str, str]) -> str:
    """The page of a run; ``links`` maps labels to paths beside the page, such as "result.csv"."""
    lines = lines_of(run)
    figures = _scene_section(run) + _outputs_section(run, lines)
    parts = [_masthead(run, links), figures_body("", figures), _extremes(run, lines), _notes(run)]
    title = f"{run.robot.name}: {_sentence(run)}"
    return html_page(title, "\n".join(parts), run_data(run, lines), ("run.js",))


def _masthead(run: Run, links: Mapping[str, str]) -> str:
    verdict, kind = _verdict(run)
    books = run.account
    cost = "" if books is None else (
        f"{books.steps} steps of the master, and {books.redos} repeats of steps until the FMUs agreed at their ends. "
        f"Of the {engineering(books.exchanged, 'J')} that the FMUs exchanged, {engineering(books.made, 'J')} came from "
        "the coupling."
    )  # fmt: skip
    if books is not None and books.error is not None:
        cost += f" Estimated error of the path: {engineering(books.error, 'm')}."
    return (
        f'<header><p class="eyebrow"><strong>Tautwire run</strong> '
        f"<span>{text(run.robot.name)}, {run.robot.cable_count} cables</span></p>"
        f'<p class="verdict verdict-{kind}">{text(verdict)}</p><h1>{text(_sentence(run))}</h1>'
        f'<p class="aside">{number(run.failure or cost)}</p>{downloads(links)}</header>'
    )


def _verdict(run: Run) -> tuple[str, str]:
    """Whether the run came to its end with all cables taut, and the class of that."""
    if run.failure is not None:
        return "Stopped: an FMU failed", "unexplained"
    slack = run.slack_cables()
    if slack:
        return f"Slack at times: {', '.join(f'cable {cable}' for cable in slack)}", "unexplained"
    return "Complete", "none"


def _sentence(run: Run) -> str:
    """The run in one sentence: how long, how far, under which tensions."""
    overview = run.overview
    duration = overview.last_time - float(overview.time[0])
    low, high = overview.extremes()
    said = f"{run.robot.name}: {significant(duration)} s"
    axes = list(run.places("", AXES))
    if axes:
        path = overview.rows[:, axes]
        travelled = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
        said += f" along {significant(travelled)} m"
    tensions = list(run.places("tension_", run.robot.cable_numbers))
    if tensions:
        said += (
            f", under tensions of {significant(np.nanmin(low[tensions]))} to {significant(np.nanmax(high[tensions]))} N"
        )
    return f"{said}."


def _extremes(run: Run, lines: Sequence[Line]) -> str:
    """Least, largest and last value of each output, and how far the recording is from it."""
    titles = list(dict.fromkeys(line.title for line in lines))
    content = "".join(_table(run, title, [line for line in lines if line.title == title]) for title in titles)
    lead = "Apart: root mean square (rms) of recorded minus co-simulated."
    return section("summary", "In figures", content, lead)


def _table(run: Run, title: str, lines: Sequence[Line]) -> str:
    """The table of one quantity; the last column only where something of it was recorded."""
    low, high = run.overview.extremes()
    ends = (run.overview.rows[0], run.overview.last_row, low, high)
    columns = [Column("Output"), *(Column(name, True) for name in ("At the start", "At the end", "Least", "Largest"))]
    rows = [[text(line.label), *(_value(line, end[line.place]) for end in ends)] for line in lines]
    if any(line.recorded is not None for line in lines):
        columns.append(Column("Apart, rms", True))
        rows = [[*row, _apart(line)] for row, line in zip(rows, lines, strict=True)]
    return table(title, columns, rows, "extremes")


def _apart(line: Line) -> str:
    unit, one = line.difference_unit
    return number("-") if math.isnan(line.apart) else f"{number(significant(line.apart / one))} {text(unit)}"


def _value(line: Line, value: float) -> str:
    if not np.isfinite(value):
        return number("-")
    return f'{number(significant(line.scale * float(value), 4))} <span class="unit">{text(line.unit)}</span>'


def _scene_section(run: Run) -> str:
    """The robot in space with its controls."""
    label = (
        f"The robot in space: {run.robot.cable_count} cables from their exit points to the platform, coloured by "
        "tension, and its path."
    )
    recorded = run.recording.has_position
    keys = key("after", "co-simulated") + (key("recorded-path", "recorded") if recorded else "")
    lead = "Cables are coloured by their tension."
    if recorded:
        lead += " What was recorded is drawn farther from the path than it is, by the factor chosen below the picture."
    return scene_section("The robot in motion", lead, label, keys, magnified=recorded)


def _outputs_section(run: Run, lines: Sequence[Line]) -> str:
    """A panel for each output over time."""
    keys = key("after", "co-simulated")
    lead = "What the FMUs showed over time"
    if any(line.recorded is not None for line in lines):
        keys += key("recorded") + key("difference", "recorded minus co-simulated")
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


def _notes(run: Run) -> str:
    lines = list(run.notes)
    if run.recording.unknown_columns:
        lines.append(f"Columns of the recording that were not read: {', '.join(run.recording.unknown_columns)}")
    return section("notes", "Notes", bullets(lines)) if lines else ""
