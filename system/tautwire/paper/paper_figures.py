"""The paper's figures drawn anew: rope tests, curves over time on the printed axes, and paths in space."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..robot.schema import Robot
from .figure_style import (
    GRID_COLOUR,
    LINE_COLOURS,
    PANEL_WIDTH,
    TEXT_COLOUR,
    PaperFigure,
    label_panel,
    legend_above,
    panel_grid,
    plain_label,
)
from .paper_parameters import DATA_FOLDER, PaperParameters, ParameterSetName, read_data
from .rope_tests import (
    BREAKING_FORCE,
    MAX_FORCE_SHARE,
    METALLIC_AREA,
    MIN_FORCE_SHARE,
    RopeTestRuns,
    secant_elongations,
    tensile_modulus,
)
from .simulation_records import ClaimValues, Records, SimulationRecord

# Axes as printed: mm and N.
TENSILE_AXIS_LIMITS = ((0.0, 1.8), (-500.0, 3500.0))
LOOP_AXIS_LIMITS = ((-0.2, 0.25), (-600.0, 600.0))

PANEL_COLUMNS = 3
AXIS_MARGIN = 0.015
SPACE_FIGURE_SIZE = 4.2
AXES_ZOOM = 0.88


def draw_rope_tests(runs: Mapping[ParameterSetName, RopeTestRuns]) -> Iterator[PaperFigure]:
    """Draw both figures of section 3."""
    yield _draw_tensile_test(runs)
    yield _draw_loops(runs["corrected"])


def _draw_tensile_test(runs: Mapping[ParameterSetName, RopeTestRuns]) -> PaperFigure:
    figure = Figure(figsize=(1.5 * PANEL_WIDTH, 3.3), layout="constrained")
    axes = figure.add_subplot()
    labels: dict[ParameterSetName, str] = {"corrected": "with relaxation", "printed": "elastic"}
    for (name, label), line, colour in zip(labels.items(), ("-", "-."), LINE_COLOURS, strict=False):
        test = runs[name].tensile
        modulus = 1e-9 * tensile_modulus(test, METALLIC_AREA)
        axes.plot(1e3 * test.elongation, test.load, line, color=colour, label=f"{label}: {modulus:.1f} GPa")
    for share, mark in ((MIN_FORCE_SHARE, "F_{10\\%}"), (MAX_FORCE_SHARE, "F_{30\\%}")):
        axes.axhline(share * BREAKING_FORCE, color=GRID_COLOUR, linewidth=0.8, linestyle=":")
        axes.text(0.02, share * BREAKING_FORCE + 40.0, f"${mark}$")
    for elongation, mark in zip(secant_elongations(runs["corrected"].tensile), ("x_1", "x_2"), strict=True):
        axes.axvline(1e3 * elongation, color=GRID_COLOUR, linewidth=0.8, linestyle=":")
        axes.text(1e3 * elongation + 0.015, TENSILE_AXIS_LIMITS[1][0] + 60.0, f"${mark}$")
    axes.set(xlim=TENSILE_AXIS_LIMITS[0], ylim=TENSILE_AXIS_LIMITS[1], xlabel="Elongation (mm)", ylabel="Load (N)")
    legend_above(figure, axes)
    description = (
        "Load over elongation of a cable FMU pulled at 0.05 mm/s up to 30 % of the breaking force and back; moduli by "
        "Eq. 7."
    )
    return PaperFigure("fig_03", "Fig. 3: load and elongation at 0.05 mm/s", description, figure)


def _draw_loops(runs: RopeTestRuns) -> PaperFigure:
    figure = Figure(figsize=(1.5 * PANEL_WIDTH, 3.3), layout="constrained")
    axes = figure.add_subplot()
    shades = np.linspace(0.0, 1.0, len(runs.loops))
    for (frequency, loop), shade in zip(runs.loops.items(), shades, strict=True):
        colour = np.array([0.12, 0.5, 0.65]) * (1.0 - shade) + np.array([0.82, 0.42, 0.15]) * shade
        axes.plot(1e3 * loop.elongation, loop.load, color=colour, label=f"{frequency:g} Hz", linewidth=1.2)
    axes.set(xlim=LOOP_AXIS_LIMITS[0], ylim=LOOP_AXIS_LIMITS[1], xlabel="Elongation (mm)", ylabel="Sinusoidal load (N)")
    axes.legend(loc="lower right", ncols=2)
    description = (
        "Loops of load over elongation at six frequencies, about a preload of 1500 N, of a cable FMU with relaxation."
    )
    return PaperFigure("fig_04", "Fig. 4: loops of the dynamic tests", description, figure)


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
    elif panel.x[0] > 0.0 and (extent := panel.extent(records, "corrected")):
        margin = 0.05 * (extent[1] - extent[0])
        axes.set_ylim(extent[0] - margin, extent[1] + margin)
    label_panel(axes, panel.label, panel.letter and f"({panel.letter})")


def _fits_printed_axis(panel: TimePanel, records: Records) -> bool:
    """Whether the curves lie on the printed axis; an axis that would clip them is not used."""
    extent = panel.extent(records, "corrected")
    if panel.y is None or extent is None:
        return False
    margin = AXIS_MARGIN * (panel.y[1] - panel.y[0])
    return panel.y[0] - margin <= extent[0] and extent[1] <= panel.y[1] + margin


def _description(figure: TimeFigure) -> str:
    panel_texts = "; ".join(f"({panel.letter or 'a'}) {plain_label(panel.label)}" for panel in figure.panels)
    runs = " and ".join(label for label in figure.labels if label)
    return f"{figure.title}, over time{': ' + runs if runs else ''}. {panel_texts}."


def _read_figure(number: str, table: Mapping[str, Any]) -> TimeFigure:
    return TimeFigure(
        number=number,
        section=table["section"],
        title=table["title"],
        labels=tuple(table["labels"]),
        lines=tuple(table["lines"]),
        corrections=tuple(table["corrections"]),
        required_claim=table.get("needs", ""),
        panels=tuple(_read_panel(number, table, entry) for entry in table["panel"]),
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


def draw_space_figures(parameters: PaperParameters, records: Records) -> Iterator[PaperFigure]:
    """Draw the paths of Figs 5a and 12b, and both robots of Fig. 9 with their paths."""
    figure = Figure(figsize=(SPACE_FIGURE_SIZE, SPACE_FIGURE_SIZE))
    _draw_path(_space_axes(figure, 111), records["three/logarithmic"], "P1", "P2")
    yield PaperFigure(
        "fig_05a", "Fig. 5a: helix of the end-effector", "The path in space: two turns upward from P1 to P2.", figure
    )
    figure = Figure(figsize=(2.0 * SPACE_FIGURE_SIZE, SPACE_FIGURE_SIZE))
    for index, name in enumerate(("caroca", "fast"), start=1):
        axes = _space_axes(figure, 120 + index)
        _draw_frame(axes, parameters.robots[name])
        _draw_path(axes, records[f"{name}/logarithmic"], "P1", "P2", offset=0.02 * _frame_size(parameters.robots[name]))
        axes.set_title(f"({'ab'[index - 1]}) {name.upper()}", loc="left", fontsize="medium")
    description = (
        "Cables from the exit points to the start, and the helix: CAROCA with three cables, FAST with six, as assumed."
    )
    yield PaperFigure("fig_09", "Fig. 9: CAROCA and FAST", description, figure)
    figure = Figure(figsize=(SPACE_FIGURE_SIZE, SPACE_FIGURE_SIZE))
    _draw_path(_space_axes(figure, 111), records["three/static"], "P1", "P3")
    yield PaperFigure("fig_12b", "Fig. 12b: path of the end-effector", "The path in space from P1 to P3.", figure)


def _space_axes(figure: Figure, position: int) -> Any:
    axes: Any = figure.add_subplot(position, projection="3d")
    for axis in "xyz":
        getattr(axes, f"set_{axis}label")(f"{axis} (m)")
        getattr(axes, f"{axis}axis").pane.set_visible(False)
    axes.tick_params(labelsize=7.5)
    axes.locator_params(nbins=5)
    axes.set_box_aspect(None, zoom=AXES_ZOOM)
    # The constrained layout ignores the labels of 3D axes.
    figure.subplots_adjust(left=0.02, right=0.94, bottom=0.05, top=0.97, wspace=0.12)
    return axes


def _draw_path(axes: Any, run: SimulationRecord, begin: str, end: str, offset: float = 0.0) -> None:
    axes.plot(run["x"], run["y"], run["z"], color=LINE_COLOURS[0], linewidth=1.6)
    for row, label in ((0, begin), (-1, end)):
        x, y, z = (run[axis][row] for axis in "xyz")
        axes.plot([x], [y], [z], "o", color=LINE_COLOURS[1], markersize=4.0)
        axes.text(x, y, z + offset, f"\u2002{label}", color=TEXT_COLOUR)


def _draw_frame(axes: Any, robot: Robot) -> None:
    start = robot.platform.start
    for number, anchor in enumerate(robot.anchors, start=1):
        axes.plot(*zip(anchor, start, strict=True), color=GRID_COLOUR, linewidth=1.0)
        axes.plot(*([value] for value in anchor), "s", color=LINE_COLOURS[2], markersize=4.0)
        axes.text(*anchor, f"\u2002$B_{number}$", color=TEXT_COLOUR)


def _frame_size(robot: Robot) -> float:
    return float(np.max(np.ptp(np.array(robot.anchors), axis=0)))
