"""A figure of the wrench-feasible workspace: slices through the robot's start."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..errors import InputError
from ..robot.schema import Robot
from ..robot.workspace import Workspace

Array = NDArray[np.float64]

AXIS_NAMES = "xyz"
SLICE_AXES = ((0, 1), (0, 2), (1, 2))
INFEASIBLE_COLOUR = "0.85"


def workspace_figure(robot: Robot, workspace: Workspace) -> Figure:
    """Draws three slices through the grid point nearest to the start, coloured by the margin in N where feasible.

    Grey is infeasible; exit points are squares, the start is a cross.
    """
    figure = Figure(figsize=(13.0, 4.6), layout="constrained")
    panels = figure.subplots(1, 3)
    feasible_margins = workspace.margin[workspace.feasible]
    max_margin = float(np.max(feasible_margins, initial=0.0)) or 1.0
    slices = [
        _draw_slice(axes, robot, workspace, *pair, max_margin) for axes, pair in zip(panels, SLICE_AXES, strict=True)
    ]
    figure.colorbar(slices[0], ax=list(panels), label="margin, N")
    figure.suptitle(f"Wrench-feasible workspace of {robot.name}")
    return figure


def require_figure_format(path: Path) -> None:
    """Raises InputError if matplotlib cannot write the format of this suffix."""
    formats = Figure().canvas.get_supported_filetypes()
    if path.suffix.removeprefix(".").lower() not in formats:
        raise InputError(
            str(path), "has no suffix of a figure", f"end it with .png, .pdf or .svg, or {', '.join(formats)}"
        )


def _draw_slice(axes: Axes, robot: Robot, workspace: Workspace, first: int, second: int, max_margin: float) -> Any:
    third = 3 - first - second
    index = int(np.argmin(np.abs(workspace.axes[third] - robot.platform.start[third])))
    margin = np.take(np.where(workspace.feasible, workspace.margin, np.nan), index, axis=third)
    axes.set_facecolor(INFEASIBLE_COLOUR)
    mesh = axes.pcolormesh(
        _cell_edges(workspace.axes[first]),
        _cell_edges(workspace.axes[second]),
        margin.T,
        vmin=0.0,
        vmax=max_margin,
        cmap="viridis",
    )
    anchors = np.array(robot.anchors)
    axes.plot(anchors[:, first], anchors[:, second], "s", color="black", markersize=5, clip_on=False)
    axes.plot(robot.platform.start[first], robot.platform.start[second], "x", color="red", markersize=8)
    axes.set_xlabel(f"{AXIS_NAMES[first]}, m")
    axes.set_ylabel(f"{AXIS_NAMES[second]}, m")
    axes.set_title(f"{AXIS_NAMES[third]} = {workspace.axes[third][index]:.4g} m")
    axes.set_aspect("equal")
    return mesh


def _cell_edges(points: Array) -> Array:
    """Cell edges around equidistant points."""
    step = points[1] - points[0] if len(points) > 1 else 1.0
    edges: Array = np.append(points, points[-1] + step) - 0.5 * step
    return edges
