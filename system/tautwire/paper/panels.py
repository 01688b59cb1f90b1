"""Draws the paper's figures over time: panels, series and printed axes are data; the curves come from the runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from .parameters import DATA_FOLDER, ParameterSetName, read_data
from .records import Records
from .style import LINE_COLOURS, PaperFigure, legend_above, panel_grid
from .values import ClaimValues

PANEL_COLUMNS = 3
AXIS_MARGIN = 0.015


@dataclass(frozen=True)
class TimePanel:
    """One panel: ``series`` of ``runs``, times ``scale`` from SI units; printed axes ``x`` and ``y`` where known.

    ``printed_scale`` is the scale by the paper's unit. ``series_names`` are of several series of one run.
    ``corrections`` replace the figure's where there are any; ``reason`` says why the curves are not on the axis.
    """

    figure: str
    letter: str
    runs: tuple[str, ...]
    series: tuple[str, ...]
    label: str
    series_names: tuple[str, ...]
    x: tuple[float, float]
    y: tuple[float, float] | None
    scale: float
    printed_scale: float
    corrections: tuple[str, ...]
    reason: str

    @property
    def name(self) -> str:
        """Name of the panel's axis, as in ``axis.07b``."""
        return f"axis.{self.figure}{self.letter}"

    def extent(self, records: Records, set_name: ParameterSetName) -> tuple[float, float] | None:
        """Smallest and largest value of the panel's curves within its times; None where a run is missing."""
        if any(run not in records for run in self.runs):
            return None
        scale = self.printed_scale if set_name == "printed" else self.scale
        values = []
        for run in self.runs:
            inside = (records[run].time >= self.x[0]) & (records[run].time <= self.x[1])
            values += [scale * records[run][series][inside] for series in self.series]
        return float(min(map(np.min, values))), float(max(map(np.max, values)))


@dataclass(frozen=True)
class TimeFigure:
    """A figure of panels; ``labels`` and ``lines`` go with the runs of each panel, the others as in a claim."""

    number: str
    section: str
    title: str
    labels: tuple[str, ...]
    lines: tuple[str, ...]
    corrections: tuple[str, ...]
    required_claim: str
    panels: tuple[TimePanel, ...]


def time_figures() -> tuple[TimeFigure, ...]:
    """Read all figures over time from the data file."""
    return tuple(
        _read_figure(number, table) for number, table in read_data(DATA_FOLDER / "panels.toml")["figure"].items()
    )


def axis_values(records: Records, set_name: ParameterSetName) -> ClaimValues:
    """Range of the curves of each panel with a printed axis, by the panel's name."""
    return {panel.name: panel.extent(records, set_name) for each in time_figures() for panel in each.panels if panel.y}


def draw_time_figures(records: Records) -> Iterator[PaperFigure]:
    """Draw all figures over time with the printed axes."""
    for each in time_figures():
        figure, axes = panel_grid(len(each.panels), PANEL_COLUMNS)
        for panel_axes, panel in zip(axes, each.panels, strict=True):
            _draw_panel(panel_axes, panel, each, records)
        legend_above(figure, axes[0])
        yield PaperFigure(f"fig_{each.number}", f"Fig. {int(each.number)}: {each.title}", _description(each), figure)


def _draw_panel(axes: Axes, panel: TimePanel, figure: TimeFigure, records: Records) -> None:
    for run_index, (run, label, line) in enumerate(zip(panel.runs, figure.labels, figure.lines, strict=True)):
        for series_index, series in enumerate(panel.series):
            colour = LINE_COLOURS[series_index if panel.series_names else run_index]
            name = panel.series_names[series_index] if panel.series_names else label
            values = panel.scale * records[run][series]
            axes.plot(records[run].time, values, line, color=colour, label=name or None)
    axes.set_xlim(panel.x)
    if panel.y and _fits_printed_axis(panel, records):
        # Without a margin a curve along the end of a printed axis would be clipped to half its width.
        margin = AXIS_MARGIN * (panel.y[1] - panel.y[0])
        axes.set_ylim(panel.y[0] - margin, panel.y[1] + margin)
    elif panel.x[0] > 0.0:
        _limit_to_data(axes, panel, records)
    axes.set_xlabel("Time (s)")
    axes.set_ylabel(panel.label)
    if panel.letter:
        axes.set_title(f"({panel.letter})", loc="left", fontsize="medium")


def _fits_printed_axis(panel: TimePanel, records: Records) -> bool:
    """Whether the curves lie on the printed axis; an axis that would clip them is not used."""
    extent = panel.extent(records, "corrected")
    if panel.y is None or extent is None:
        return False
    margin = AXIS_MARGIN * (panel.y[1] - panel.y[0])
    return panel.y[0] - margin <= extent[0] and extent[1] <= panel.y[1] + margin


def _limit_to_data(axes: Axes, panel: TimePanel, records: Records) -> None:
    extent = panel.extent(records, "corrected")
    if extent is not None:
        margin = 0.05 * (extent[1] - extent[0])
        axes.set_ylim(extent[0] - margin, extent[1] + margin)


def _description(figure: TimeFigure) -> str:
    panel_texts = "; ".join(f"({panel.letter or 'a'}) {_plain_label(panel.label)}" for panel in figure.panels)
    runs = " and ".join(label for label in figure.labels if label)
    return f"{figure.title}, over time{': ' + runs if runs else ''}. {panel_texts}."


def _plain_label(label: str) -> str:
    return label.replace("$", "").replace("\\Delta", "error").replace("_", " ").replace("\\dot", "rate of")


def _read_figure(number: str, table: Mapping[str, Any]) -> TimeFigure:
    panels = tuple(_read_panel(number, table, entry) for entry in table["panel"])
    return TimeFigure(
        number=number,
        section=table["section"],
        title=table["title"],
        labels=tuple(table["labels"]),
        lines=tuple(table["lines"]),
        corrections=tuple(table["corrections"]),
        required_claim=table.get("needs", ""),
        panels=panels,
    )


def _read_panel(number: str, table: Mapping[str, Any], entry: Mapping[str, Any]) -> TimePanel:
    scale = entry.get("scale", 1.0)
    x, y = entry["x"], entry.get("y")
    return TimePanel(
        figure=number,
        letter=entry["letter"],
        runs=tuple(entry.get("runs", table["runs"])),
        series=tuple(entry["series"]),
        label=entry["label"],
        series_names=tuple(entry.get("names", ())),
        x=(x[0], x[1]),
        y=(y[0], y[1]) if y else None,
        scale=scale,
        printed_scale=entry.get("printed_scale", scale),
        corrections=tuple(entry.get("corrections", ())),
        reason=entry.get("reason", ""),
    )
