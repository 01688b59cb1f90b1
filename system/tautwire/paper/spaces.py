"""Draws the paper's figures in space: Fig. 5a, Fig. 9 and Fig. 12b."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..robots.robot import Robot
from .parameters import PaperParameters
from .records import Records, SimulationRecord
from .style import GRID_COLOUR, LINE_COLOURS, TEXT_COLOUR, PaperFigure

SPACE_FIGURE_SIZE = 4.2
AXES_ZOOM = 0.88


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
