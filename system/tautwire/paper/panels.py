"""The paper's figures over time: panels, series and printed axes are data; the curves come from the runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from .parameters import DATA, SetName, read_data
from .records import Records
from .style import COLOURS, Drawn, legend_above, panel_grid
from .values import Values

COLUMNS = 3
MARGIN = 0.015


@dataclass(frozen=True)
class Panel:
    """One panel: ``series`` of ``runs``, times ``scale`` from SI units; printed axes ``x`` and ``y`` where known.

    ``printed_scale`` is what the paper asks for. ``names`` are of several series of one run. ``corrections`` stand in
    place of the figure's where there are any; ``reason`` says why the curves are not on the axis.
    """

    figure: str
    letter: str
    runs: tuple[str, ...]
    series: tuple[str, ...]
    label: str
    names: tuple[str, ...]
    x: tuple[float, float]
    y: tuple[float, float] | None
    scale: float
    printed_scale: float
    corrections: tuple[str, ...]
    reason: str

    @property
    def name(self) -> str:
        """As in ``axis.07b``."""
        return f"axis.{self.figure}{self.letter}"

    def extent(self, records: Records, which: SetName) -> tuple[float, float] | None:
        """Least and largest value that the panel shows within its times; None where a run is not there."""
        if any(run not in records for run in self.runs):
            return None
        scale = self.printed_scale if which == "printed" else self.scale
        shown = []
        for run in self.runs:
            inside = (records[run].time >= self.x[0]) & (records[run].time <= self.x[1])
            shown += [scale * records[run][series][inside] for series in self.series]
        return float(min(map(np.min, shown))), float(max(map(np.max, shown)))


@dataclass(frozen=True)
class TimeFigure:
    """A figure of panels; ``labels`` and ``lines`` go with the runs of each panel, the others as in a claim."""

    number: str
    section: str
    title: str
    labels: tuple[str, ...]
    lines: tuple[str, ...]
    corrections: tuple[str, ...]
    needs: str
    panels: tuple[Panel, ...]


def time_figures() -> tuple[TimeFigure, ...]:
    """All figures over time, as the data file describes them."""
    return tuple(_figure(number, table) for number, table in read_data(DATA / "panels.toml")["figure"].items())


def axis_values(records: Records, which: SetName) -> Values:
    """What each panel with a printed axis shows at least and at most, by its name."""
    return {panel.name: panel.extent(records, which) for each in time_figures() for panel in each.panels if panel.y}


def draw_time_figures(records: Records) -> Iterator[Drawn]:
    """All figures over time with the printed axes."""
    for each in time_figures():
        figure, axes = panel_grid(len(each.panels), COLUMNS)
        for place, panel in zip(axes, each.panels, strict=True):
            _draw(place, panel, each, records)
        legend_above(figure, axes[0])
        yield Drawn(f"fig_{each.number}", f"Fig. {int(each.number)}: {each.title}", _told(each), figure)


def _draw(axes: Axes, panel: Panel, each: TimeFigure, records: Records) -> None:
    for place, (run, label, line) in enumerate(zip(panel.runs, each.labels, each.lines, strict=True)):
        for number, series in enumerate(panel.series):
            colour = COLOURS[number if panel.names else place]
            name = panel.names[number] if panel.names else label
            shown = panel.scale * records[run][series]
            axes.plot(records[run].time, shown, line, color=colour, label=name or None)
    axes.set_xlim(panel.x)
    if panel.y and _fits(panel, records):
        # A curve along the end of a printed axis would be cut in half.
        margin = MARGIN * (panel.y[1] - panel.y[0])
        axes.set_ylim(panel.y[0] - margin, panel.y[1] + margin)
    elif panel.x[0] > 0.0:
        _limit_to_shown(axes, panel, records)
    axes.set_xlabel("Time (s)")
    axes.set_ylabel(panel.label)
    if panel.letter:
        axes.set_title(f"({panel.letter})", loc="left", fontsize="medium")


def _fits(panel: Panel, records: Records) -> bool:
    """Whether the curves lie on the printed axis; one that would cut them off is not taken."""
    extent = panel.extent(records, "corrected")
    if panel.y is None or extent is None:
        return False
    margin = MARGIN * (panel.y[1] - panel.y[0])
    return panel.y[0] - margin <= extent[0] and extent[1] <= panel.y[1] + margin


def _limit_to_shown(axes: Axes, panel: Panel, records: Records) -> None:
    extent = panel.extent(records, "corrected")
    if extent is not None:
        around = 0.05 * (extent[1] - extent[0])
        axes.set_ylim(extent[0] - around, extent[1] + around)


def _told(each: TimeFigure) -> str:
    shown = "; ".join(f"({panel.letter or 'a'}) {_plain(panel.label)}" for panel in each.panels)
    runs = " and ".join(label for label in each.labels if label)
    return f"{each.title}, over time{': ' + runs if runs else ''}. {shown}."


def _plain(label: str) -> str:
    return label.replace("$", "").replace("\\Delta", "error").replace("_", " ").replace("\\dot", "rate of")


def _figure(number: str, table: Mapping[str, Any]) -> TimeFigure:
    panels = tuple(_panel(number, table, entry) for entry in table["panel"])
    return TimeFigure(
        number=number,
        section=table["section"],
        title=table["title"],
        labels=tuple(table["labels"]),
        lines=tuple(table["lines"]),
        corrections=tuple(table["corrections"]),
        needs=table.get("needs", ""),
        panels=panels,
    )


def _panel(number: str, table: Mapping[str, Any], entry: Mapping[str, Any]) -> Panel:
    scale = entry.get("scale", 1.0)
    x, y = entry["x"], entry.get("y")
    return Panel(
        figure=number,
        letter=entry["letter"],
        runs=tuple(entry.get("runs", table["runs"])),
        series=tuple(entry["series"]),
        label=entry["label"],
        names=tuple(entry.get("names", ())),
        x=(x[0], x[1]),
        y=(y[0], y[1]) if y else None,
        scale=scale,
        printed_scale=entry.get("printed_scale", scale),
        corrections=tuple(entry.get("corrections", ())),
        reason=entry.get("reason", ""),
    )
